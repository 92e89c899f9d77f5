"""A browser, and services with the embedded backbone that it looks at. What goes wrong in a page, or leaves the service, fails a test."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, ConsoleMessage, Page, Request, Response, expect, sync_playwright

from clients.robot import RobotClient
from service.settings import Settings

TABLET = {"width": 1180, "height": 820}
WAIT_MS = 30_000
"""For answers of the backbone, on a machine that does other things too."""
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
"""For root, and for 3-D on a machine without a graphics card."""
SERIOUS = {"serious", "critical"}
expect.set_options(timeout=WAIT_MS)


@dataclass
class Tab:
    """A page, and what went wrong in it."""

    page: Page
    own: str
    """Address of the service."""
    expects: set[int] = field(default_factory=set)
    """Statuses of errors that the test asks for."""
    wrong: list[str] = field(default_factory=list)

    def watch(self) -> None:
        """From now on."""
        self.page.on("console", self._said)
        self.page.on("pageerror", lambda error: self.wrong.append(f"script: {error}"))
        self.page.on("requestfailed", self._failed)
        self.page.on("request", self._asked)
        self.page.on("response", self._answered)

    def open(self, path: str) -> Page:
        """The page at a path of the service."""
        self.page.goto(self.own + path)
        return self.page

    def violations(self) -> list[str]:
        """What axe-core calls serious, as the page is now."""
        found = Axe().run(self.page).response["violations"]
        serious = [(each["id"], node) for each in found if each["impact"] in SERIOUS for node in each["nodes"]]
        return [f"{rule}: {node['html']} {node['failureSummary']}" for rule, node in serious]

    def wider_than_the_screen(self) -> int:
        """Pixels by which one would have to scroll sideways."""
        return int(self.page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth"))

    def _said(self, message: ConsoleMessage) -> None:
        status = next((each for each in self.expects if f"status of {each}" in message.text), None)
        if message.type == "error" and status is None:
            self.wrong.append(f"console: {message.text}")

    def _failed(self, request: Request) -> None:
        # Leaving a page ends its stream of events, and pictures that were on their way.
        if request.failure != "net::ERR_ABORTED":
            self.wrong.append(f"failed: {request.url} {request.failure}")

    def _asked(self, request: Request) -> None:
        if urlsplit(request.url).scheme != "blob" and not request.url.startswith(self.own):
            self.wrong.append(f"not of the service: {request.url}")

    def _answered(self, response: Response) -> None:
        if response.status >= 400 and response.status not in self.expects:
            self.wrong.append(f"answered {response.status}: {response.url}")


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Debian's Chromium; its event loop ends with this package, since other tests have their own."""
    path = shutil.which("chromium")
    assert path is not None, "Chromium is missing; run `make browser`, or as root: apt-get install chromium"
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def service(serving: Any, embedded_backbone: Any, tmp_path_factory: Any) -> Iterator[str]:
    """The address of a service whose memory is empty at the module's beginning."""
    folder: Path = tmp_path_factory.mktemp("console") / "memory"
    with serving(Settings(data_dir=folder, variant="ucd"), embedded_backbone) as url:
        yield url


@pytest.fixture(scope="module")
def robot(service: str) -> Iterator[RobotClient]:
    """A client of it."""
    with RobotClient(service) as client:
        yield client


@pytest.fixture
def tabs(browser: Browser, service: str) -> Iterator[Callable[..., Tab]]:
    """tabs(**context): another page, of a browser with these options; at the end nothing may have gone wrong in any."""
    opened: list[Tab] = []

    def new(**options: Any) -> Tab:
        context = browser.new_context(**({"viewport": TABLET, "reduced_motion": "reduce"} | options))
        context.set_default_timeout(WAIT_MS)
        tab = Tab(context.new_page(), service)
        tab.watch()
        opened.append(tab)
        return tab

    yield new
    for tab in opened:
        tab.page.context.close()
    assert [each for tab in opened for each in tab.wrong] == []


@pytest.fixture
def tab(tabs: Callable[..., Tab]) -> Tab:
    """One page."""
    return tabs()

"""Pictures of the console's pages for docs/, light and dark, of the memory that `make demo` leaves.

    make demo
    python tests/console/take_pictures.py --run out/demo --category locomotive --out docs/console

The robot of the demo learns categories without names; here they get those of the episode's report, and one more object is being scanned.
The memory is copied, not changed.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT)]

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from playwright.sync_api import Browser, Page, sync_playwright  # noqa: E402

from clients.datasets.folders import find_sequences, load_burst  # noqa: E402
from clients.robot import RobotClient  # noqa: E402
from clients.simulator.local_service import local_service  # noqa: E402

WIDE = {"width": 1280, "height": 860}
PHONE = {"width": 390, "height": 780}
QUALITY = 62
DARK = ("now",)
"""Pages that are also taken in the dark."""
LONG = ("observation", "category", "memory")
"""Pages that are taken whole."""
SCANNED = 7
"""Views of the scan in progress."""
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def main() -> None:
    """See module."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, default=Path("out/demo"))
    parser.add_argument("--category", help="Whose page is shown, and an observation of it.")
    parser.add_argument("--out", type=Path, default=Path("docs/console"))
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        memory = Path(folder) / "memory"
        shutil.copytree(asked.run / "memory", memory)
        with local_service(memory, Path(folder) / "log") as url, sync_playwright() as playwright:
            with RobotClient(url) as robot:
                name(robot, asked.run / "episode.json")
                begin_scan(robot)
                paths = addresses(robot, asked.category)
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            for scheme, titles in (("light", tuple(paths)), ("dark", DARK)):
                for title in titles:
                    path = paths[title]
                    with page(browser, scheme, WIDE, url + path) as opened:
                        save(opened, asked.out / f"{title}-{scheme}.jpg", whole=title in LONG)
            with page(browser, "light", PHONE, url + "/") as opened:
                save(opened, asked.out / "now-phone.jpg", whole=False)
            browser.close()


def name(robot: RobotClient, report: Path) -> None:
    """Calls each category what the first object was of that it was learnt from."""
    for row in json.loads(report.read_text())["rows"]:
        if row["learnt"]:
            robot.rename(row["learnt"], row["category"])


def begin_scan(robot: RobotClient) -> None:
    """Something new, part of whose views came."""
    (sequence,) = find_sequences(ROOT / "tests" / "data" / "bursts" / "cup" / "cup_1")
    burst = load_burst(sequence)
    seen = robot.observe(burst.select(range(0, len(burst), 2)), learn=False)
    assert seen.scan is not None, seen.outcome
    for view in burst.views[:SCANNED]:
        seen.scan.add(view)


def addresses(robot: RobotClient, category: str | None) -> dict[str, str]:
    """Of each page; of the known observations, of this category if one is named, the one with the surest pose."""
    known = [each for each in robot.observations(limit=50, outcome="known") if each.pose is not None and category in (None, each.name)]
    shown = max(known, key=lambda each: each.pose.confidence or 0.0)
    ones = {"observation": f"/observations/{shown.id}", "category": f"/categories/{shown.category_id}"}
    return {"now": "/", "categories": "/categories", "observations": "/observations", "memory": "/memory", "try": "/try"} | ones


@contextmanager
def page(browser: Browser, scheme: str, size: dict[str, int], address: str) -> Iterator[Page]:
    """One, once it is drawn."""
    context = browser.new_context(viewport=size, color_scheme=scheme, reduced_motion="reduce")
    opened = context.new_page()
    opened.goto(address)
    for viewer in opened.locator("figure.viewer").all():
        viewer.scroll_into_view_if_needed()
        viewer.locator("canvas").wait_for()
    opened.wait_for_load_state("load")
    for part in opened.locator("[hx-trigger=load]").all():
        part.wait_for(state="detached")  # what comes later is in its place
    opened.evaluate(
        "Promise.all([...document.images].map((image) => { image.loading = 'eager'; return image.decode().catch(() => null); }))"
    )
    opened.evaluate("window.scrollTo(0, 0)")
    opened.wait_for_timeout(1500)
    yield opened
    context.close()


def save(opened: Page, path: Path, *, whole: bool) -> None:
    """As a JPEG that is as wide as the page."""
    picture = cv2.imdecode(np.frombuffer(opened.screenshot(full_page=whole), np.uint8), cv2.IMREAD_COLOR)
    cv2.imwrite(str(path), picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY, cv2.IMWRITE_JPEG_PROGRESSIVE, 1, cv2.IMWRITE_JPEG_OPTIMIZE, 1])
    sys.stdout.write(f"{path}  {path.stat().st_size / 1000:.0f} kB\n")


if __name__ == "__main__":
    main()

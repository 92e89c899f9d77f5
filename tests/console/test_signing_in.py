"""A person's key at the console: signing in, what each role is offered, signing out."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from service.settings import Settings
from store.memory import Memory


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    """The folder of a memory, and a key of each role by it."""
    folder = tmp_path_factory.mktemp("keys") / "memory"
    with Memory.keyring(folder) as ring:
        return folder, {role: ring.create(f"{role} key", role)[1] for role in ("viewer", "admin")}


@pytest.fixture(scope="module")
def service(serving, keys, colour_backbone):
    """A service that asks for them: who signs in needs no real backbone."""
    with serving(Settings(data_dir=keys[0], score="best"), colour_backbone) as url:
        yield url


def sign_in(page, key):
    """As a person does."""
    page.get_by_label("Key", exact=True).fill(key)
    page.get_by_role("button", name="Sign in").click()


def test_one_is_asked_and_led_on(tab, keys):
    page = tab.open("/memory")
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    assert tab.violations() == []
    sign_in(page, keys[1]["admin"])
    expect(page.get_by_role("heading", name="Memory", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name="Back up")).to_be_visible()
    page.get_by_role("button", name="Sign out").click()
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    tab.open("/memory")
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()


def test_a_wrong_key_is_told(tab):
    tab.expects.add(401)
    page = tab.open("/sign-in")
    sign_in(page, "onelook_0_0")
    expect(page.get_by_role("alert")).to_contain_text("no key of this service")


def test_a_session_that_ends_while_one_watches_leads_to_the_sign_in(tab, keys):
    def end_session(events):
        assert page.context.request.post(f"{tab.own}/sign-out").ok
        events.continue_()

    tab.expects.add(401)
    page = tab.open("/sign-in")
    page.route("**/v1/events*", end_session)
    with page.expect_response("**/v1/events*") as refused:
        sign_in(page, keys[1]["viewer"])
    assert refused.value.status == 401
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()


def test_a_viewer_is_offered_nothing_to_change(tab, keys):
    page = tab.open("/memory")
    sign_in(page, keys[1]["viewer"])
    expect(page.get_by_role("heading", name="Memory", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name="Back up")).to_have_count(0)
    tab.expects.add(403)
    status = page.evaluate("fetch('/memory/backup', {method: 'POST'}).then((answer) => answer.status)")
    assert status == 403

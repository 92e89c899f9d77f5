"""The demo episode, begun by a person, while another looks at what happens now; and that it ends with the service."""

from __future__ import annotations

from playwright.sync_api import expect


def test_an_episode_runs_while_the_live_page_updates(tabs, robot):
    starter, watcher = tabs(), tabs()
    now = watcher.open("/")
    expect(now.get_by_text("Nothing was looked at yet")).to_be_visible()
    page = starter.open("/try")
    page.get_by_role("button", name="Run the demo episode").click()
    expect(page.get_by_role("progressbar")).to_be_visible()
    expect(now.locator("#feed > li")).to_have_count(1, timeout=120_000)
    expect(now.get_by_text("Nothing was looked at yet")).to_be_hidden()
    expect(now.locator(".scan").first).to_contain_text("views received", timeout=60_000)
    page.get_by_role("button", name="Stop it").click()
    expect(page.locator("#demo")).to_contain_text("it was stopped")
    expect(page.get_by_role("button", name="Run the demo episode")).to_be_visible()

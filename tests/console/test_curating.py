"""What a person does with what is known: looking at a category, renaming, merging, deleting, taking back, copying."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect

from tests.service.conftest import until

PHONE = {"width": 390, "height": 844}


@pytest.fixture(scope="module")
def categories(robot, recorded):
    """Two, by name; the first with a second burst."""
    made = {}
    for name, folder in (("cup", "cup/cup_1"), ("tv", "tv/tv_1")):
        burst = recorded(folder, range(0, 12, 4))
        scan = robot.scan(burst.select([0, 2]))
        for view in burst.views:
            scan.add(view)
        made[name] = scan.complete(name)
    robot.observe(recorded("cup/cup_1", range(1, 12, 6)), category_id=made["cup"].id)
    return made


@pytest.fixture
def cup(categories, robot):
    """The one with two bursts, called so again at the end."""
    yield categories["cup"].id
    assert robot.category(categories["cup"].id).name == "cup"


@pytest.fixture
def tv(categories):
    """The other one."""
    return categories["tv"].id


@pytest.fixture
def paths(cup, tv):
    """Every page of this module."""
    return ("/categories", f"/categories/{cup}", f"/categories/{cup}/merge", f"/categories/{cup}/merge?into={tv}", "/memory")


def test_pages_are_for_everyone(tabs, paths):
    tab = tabs()
    for path in paths:
        tab.open(path).wait_for_load_state("networkidle")
        assert tab.violations() == [], path


def test_pages_are_for_phones_and_the_dark(tabs, paths):
    tab = tabs(viewport=PHONE, has_touch=True, is_mobile=True, color_scheme="dark")
    for path in paths:
        tab.open(path).wait_for_load_state("networkidle")
        assert tab.wider_than_the_screen() == 0, path
        assert [each for each in tab.violations() if each.startswith("color-contrast")] == [], path


def test_one_goes_from_the_grid_to_a_category(tab, cup):
    page = tab.open("/categories")
    page.get_by_label("Name or id").fill("cu")
    expect(page.get_by_text("1 category")).to_be_visible()
    page.get_by_role("link", name="cup").click()
    expect(page.get_by_role("heading", name="cup", level=1)).to_be_visible()
    expect(
        page.get_by_role("img", name="View 1 in the colours", exact=False).or_(page.get_by_alt_text(re.compile("View 1 parts"))).first
    ).to_be_visible()
    expect(page.locator("#nearest + *, .nearest").get_by_text("tv").first).to_be_visible()


def test_a_category_is_turned_in_space(tab, cup):
    page = tab.open(f"/categories/{cup}")
    figure = page.locator("figure.viewer[data-ready]")
    expect(figure).to_be_visible()
    canvas = figure.locator("canvas")
    expect(canvas).to_have_attribute("aria-label", re.compile(r"surface.*\d+ points, 3 cameras"))
    before = canvas.screenshot()
    canvas.focus()
    page.keyboard.press("ArrowRight")
    until(lambda: canvas.screenshot() != before)
    turned = canvas.screenshot()
    page.get_by_role("button", name="Components").click()
    until(lambda: canvas.screenshot() != turned)
    cameras = page.get_by_role("button", name="Cameras")
    cameras.click()
    expect(cameras).to_have_attribute("aria-pressed", "true")


def test_a_rename_and_the_way_back(tab, cup):
    page = tab.open(f"/categories/{cup}")
    page.get_by_label("Name", exact=True).fill("tea cup")
    page.get_by_role("button", name="Rename").click()
    expect(page.get_by_role("heading", name="tea cup", level=1)).to_be_visible()
    page.get_by_role("button", name="Undo", exact=True).click()
    expect(page.get_by_role("heading", name="cup", level=1, exact=True)).to_be_visible()
    expect(page.get_by_text("Took back: rename").first).to_be_visible()


def test_a_merge_is_previewed_done_and_taken_back(tab, cup, tv, robot):
    page = tab.open(f"/categories/{cup}")
    page.get_by_role("link", name="Merge into another").click()
    page.get_by_role("radio", name="tv").check()
    page.get_by_role("button", name="See what changes").click()
    expect(page.get_by_text("1 + 2 = 3")).to_be_visible()
    page.wait_for_load_state("networkidle")  # else its pictures would be asked for when it is gone
    page.get_by_role("button", name="Merge", exact=True).click()
    expect(page.get_by_role("heading", name="tv", level=1)).to_be_visible()
    assert [each.name for each in robot.categories()] == ["tv"]
    page.get_by_role("button", name="Undo", exact=True).click()
    expect(page.get_by_text("Took back: merge").first).to_be_visible()
    assert robot.category(cup).instances == 2
    assert robot.category(tv).instances == 1


def test_a_deletion_asks_first_and_is_taken_back_from_the_changes(tab, cup, robot):
    page = tab.open(f"/categories/{cup}")
    page.get_by_role("link", name="Delete").click()
    page.wait_for_load_state("networkidle")  # else its pictures would be asked for when it is gone
    page.get_by_role("button", name="Delete").click()
    expect(page.get_by_text("1 category")).to_be_visible()
    page = tab.open("/memory")
    page.get_by_role("button", name="Undo: Deleted “cup”").click()
    expect(page.get_by_role("heading", name="cup", level=1)).to_be_visible()
    assert robot.category(cup).instances == 2


def test_an_export_is_imported_again(tab, cup, robot, tmp_path):
    page = tab.open("/memory")
    page.get_by_text("Only some of them").click()
    page.get_by_role("checkbox", name="cup").check()
    with page.expect_download() as download:
        page.get_by_role("button", name="Export").click()
    file = tmp_path / "cup.zip"
    download.value.save_as(file)
    page.wait_for_load_state("networkidle")  # else its pictures would be asked for when it is gone
    robot.forget(cup)
    page = tab.open("/memory")
    page.get_by_label("File").set_input_files(file)
    page.get_by_role("button", name="Import").click()
    expect(page.get_by_text("Imported 1 category").first).to_be_visible()
    (twin,) = [each for each in robot.categories() if each.name == "cup"]
    assert twin.instances == 2
    page.wait_for_load_state("networkidle")
    robot.forget(twin.id)
    page = tab.open("/memory")
    page.get_by_role("button", name="Undo: Deleted “cup”").last.click()
    expect(page.get_by_role("heading", name="cup", level=1)).to_be_visible()


def test_a_file_that_is_no_export_is_refused_in_words(tab, categories, tmp_path):
    tab.expects.add(422)
    file = tmp_path / "notes.zip"
    file.write_text("not a zip file")
    page = tab.open("/memory")
    page.get_by_label("File").set_input_files(file)
    page.get_by_role("button", name="Import").click()
    expect(page.get_by_text("is no zip file that can be read")).to_be_visible()
    expect(page.get_by_role("button", name="Import")).to_be_enabled()


def test_a_backup_says_where_it_is(tab, categories):
    page = tab.open("/memory")
    page.get_by_role("button", name="Back up").click()
    expect(page.get_by_text(re.compile(r"Backed up the memory to .*-backups/")).first).to_be_visible()


def test_the_map_names_every_category(tab, cup, tv):
    page = tab.open("/memory")
    drawing = page.get_by_role("img", name=re.compile("3 bursts of 2 categories"))
    expect(drawing).to_be_visible()
    for name in ("cup", "tv"):
        expect(drawing.locator("text").get_by_text(name)).to_be_visible()

"""Scripts: what a YAML file may say, and what it is told when it says something else."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest
import yaml

from clients.simulator.raycast.world import RaycastSubject
from clients.simulator.script import Script, read_script, script_from
from core.errors import InvalidInput


def test_an_empty_file_is_the_demo(tmp_path: Path) -> None:
    file = tmp_path / "episode.yaml"
    file.write_text("# nothing\n")
    assert read_script(file) == Script()


def test_a_script_says_what_is_met_in_which_order(tmp_path: Path) -> None:
    file = tmp_path / "episode.yaml"
    file.write_text("categories: [mug, present]\ninstances: 2\norder: grouped\nseed: 4\nlength: 5\nfaults:\n  sensor: {speckle: 0.2}\n")
    script = read_script(file)
    subjects = script.subjects()
    assert [each.category for each in subjects[:4]] == ["mug", "mug", "present", "present"]
    assert len(subjects) == 5
    assert len({each.name for each in subjects[:4]}) == 4
    assert isinstance(subjects[0], RaycastSubject)
    assert subjects[0].sensor is not None
    assert subjects[0].sensor.speckle == 0.2
    assert script.as_settings()["categories"] == ("mug", "present")


def test_the_documented_script_is_one(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs" / "simulator.md").read_text()
    (block,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    file = tmp_path / "episode.yaml"
    file.write_text("\n".join(line for line in block.splitlines() if "FOLDER" not in line))
    assert read_script(file).length == 40
    assert set(yaml.safe_load(block)) == {field.name for field in fields(Script)}


def test_robots_of_one_script_meet_other_objects() -> None:
    script = Script(categories=("mug",), instances=2, robots=2)
    assert not {each.name for each in script.subjects(0)} & {each.name for each in script.subjects(1)}


def test_recordings_are_played_by_category() -> None:
    assert {each.category for each in Script(world="replay", categories=("cup",)).subjects()} == {"cup"}


@pytest.mark.parametrize(
    ("content", "field"),
    [
        ({"worlds": "raycast"}, "worlds"),
        ({"world": "moon"}, "world"),
        ({"views": 0}, "views"),
        ({"views": "many"}, "views"),
        ({"waypoints": -1}, "waypoints"),
        ({"waypoints": 2, "teacher": True}, "waypoints"),
        ({"robots": 2, "teacher": True}, "robots"),
        ({"faults": {"lost_views": 0.1}, "teacher": True}, "faults.lost_views"),
        ({"categories": ["mug"], "meshes": "somewhere"}, "categories"),
        ({"seed": -1}, "seed"),
        ({"views": True}, "views"),
        ({"teacher": 1}, "teacher"),
        ({"length": "ten"}, "length"),
        ({"categories": "mug"}, "categories"),
        ({"categories": 3}, "categories"),
        ({"faults": {"lost": 1}}, "faults.lost"),
        ({"faults": {"lost_views": 1.5}}, "faults.lost_views"),
        ({"faults": {"lost_views": "0.5"}}, "faults.lost_views"),
        ({"faults": {"lost_views": False}}, "faults.lost_views"),
        ({"faults": {"sensor": {"speckle": "0.1"}}}, "faults.sensor.speckle"),
        ({"world": "replay", "faults": {"sensor": {"speckle": 0.1}}}, "faults.sensor"),
        ({"data": "somewhere"}, "data"),
        ({"world": "replay", "data": 3}, "data"),
        (["a", "list"], "script"),
    ],
)
def test_what_is_wrong_is_named(content: object, field: str) -> None:
    with pytest.raises(InvalidInput) as raised:
        script_from(content)
    assert str(raised.value).startswith(f"{field}: ")


def test_unknown_settings_and_categories_are_named_when_objects_are_drawn() -> None:
    for name in ("fog", "size"):  # a size is two numbers, and settings are one each
        with pytest.raises(InvalidInput, match=rf"faults\.sensor\.{name}: is none of focal_px"):
            script_from({"faults": {"sensor": {name: 1}}}).subjects()
    with pytest.raises(InvalidInput, match="'unicorn' is none of"):
        Script(categories=("unicorn",)).subjects()
    with pytest.raises(InvalidInput, match="unicorn: not in the recordings"):
        Script(world="replay", categories=("unicorn",)).subjects()


def test_what_is_no_yaml_is_said_to_be_none(tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text("a: [1,")
    with pytest.raises(InvalidInput, match="is not YAML"):
        read_script(tmp_path / "bad.yaml")
    with pytest.raises(InvalidInput, match="there is no file"):
        read_script(tmp_path / "none.yaml")

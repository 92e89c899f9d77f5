"""The door to every data set."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from clients.datasets.folders import Sequence
from clients.datasets.sources import FORMATS, find_sequences, only_sequence
from core.errors import InvalidInput


def test_a_folder_alone_is_in_the_data_layout(recordings: list[Sequence]) -> None:
    root = recordings[0].path.parents[1]
    names = [each.name for each in recordings]
    assert [each.name for each in find_sequences(root)] == [each.name for each in find_sequences(str(root))] == names


def test_a_prefix_names_the_format(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((40, 40, 3), np.uint8))
    (sequence,) = find_sequences(f"images:{tmp_path}")
    assert sequence.images == (tmp_path / "a.png",)
    assert find_sequences(Path(f"images:{tmp_path}"))[0].name == sequence.name


def test_a_folder_with_a_colon_is_still_a_folder(tmp_path: Path) -> None:
    (tmp_path / "co3d:cup").mkdir()
    with pytest.raises(InvalidInput, match=r"sequence\.json"):
        find_sequences(tmp_path / "co3d:cup")


@pytest.mark.parametrize("data", ["kitti:/data", "https://example.org"])
def test_an_unknown_format_is_named_beside_those_there_are(data: str) -> None:
    with pytest.raises(InvalidInput, match=", ".join(FORMATS)):
        find_sequences(data)


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_every_format_is_a_row_of_the_page_on_data(name: str) -> None:
    page = Path(__file__).parents[3] / "docs" / "data.md"
    listed = re.findall(r"^\| `(\w+):FOLDER` \|", page.read_text(), re.MULTILINE)
    assert name in listed, f"docs/data.md has no row `{name}:FOLDER` in its first table"


@pytest.mark.parametrize("data", ["bop:/nowhere", "/nowhere"])
def test_a_folder_that_is_none_is_named(data: str) -> None:
    with pytest.raises(InvalidInput, match="/nowhere is no folder"):
        find_sequences(data)


def test_of_a_file_the_folder_is_named_as_it_can_be_asked_for(tmp_path: Path) -> None:
    file = tmp_path / "transforms.json"
    file.touch()
    with pytest.raises(InvalidInput, match=f"is a file; name the folder that holds it: transforms:{tmp_path}$"):
        find_sequences(f"transforms:{file}")
    with pytest.raises(InvalidInput, match=f"is a file; name the folder that holds it: {tmp_path}$"):
        find_sequences(file)


def test_of_several_objects_one_is_named_as_it_can_be_asked_for(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        cv2.imwrite(str(tmp_path / name / "0.png"), np.zeros((40, 40, 3), np.uint8))
    with pytest.raises(InvalidInput, match=f"2 objects; name one, such as images:{tmp_path / 'a'}"):
        only_sequence(f"images:{tmp_path}")
    assert only_sequence(f"images:{tmp_path / 'a'}").instance == "a"

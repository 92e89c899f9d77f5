"""`onelook memory` on a memory's folder."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from clients.cli import app
from core import backbones
from core.backbones.base import Backbone
from core.encode import Encoder
from core.reference import build_reference
from core.views import Burst
from store.memory import Memory


@pytest.fixture
def data_dir(tmp_path: Path) -> Path:
    """A memory of one category, called cup."""
    shutil.unpack_archive(Path(__file__).parents[2] / "data" / "memory_m001.zip", tmp_path / "memory")
    return tmp_path / "memory"


def memory(*words: object) -> Result:
    return CliRunner().invoke(app, ["memory", *(str(word) for word in words)])


def answered(*words: object) -> dict:
    done = memory(*words, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_what_is_there_is_told(data_dir: Path) -> None:
    facts = answered("info", "--data-dir", data_dir)
    assert (facts["backbone"], facts["categories"], facts["instances"], facts["scans"]) == ("dinov2-s14", 1, 2, 1)
    assert "MB" in memory("info", "--data-dir", data_dir).output
    (listed,) = answered("list", "--data-dir", data_dir)
    assert (listed["name"], listed["instances"]) == ("cup", 2)
    assert "cup" in memory("list", "--data-dir", data_dir).output


def test_the_folder_of_the_settings_is_taken(data_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ONELOOK_DATA_DIR", str(data_dir))
    assert answered("info")["folder"] == str(data_dir)


def test_damage_is_named_and_fails(data_dir: Path) -> None:
    whole = memory("check", "--data-dir", data_dir)
    assert whole.exit_code == 0
    assert "everything is what was written" in whole.output
    picture = next((data_dir / "categories").glob("*/001_rgb.png"))
    picture.write_bytes(b"")
    damaged = memory("check", "--data-dir", data_dir)
    assert damaged.exit_code == 1
    assert f"category cup: {picture.relative_to(data_dir)}: has 0 bytes" in damaged.output
    told = json.loads(memory("check", "--data-dir", data_dir, "--json").output)
    assert (told["ok"], told["damages"][0]["name"]) == (False, "cup")


def test_a_backup_is_a_memory(data_dir: Path, tmp_path: Path) -> None:
    done = answered("backup", tmp_path / "copy", "--data-dir", data_dir)
    assert done["damages"] == []
    assert answered("check", "--data-dir", tmp_path / "copy")["files"] == done["files"]
    again = memory("backup", tmp_path / "copy", "--data-dir", data_dir)
    assert (again.exit_code, "exists" in again.output) == (1, True)


def test_categories_travel_in_a_file(data_dir: Path, tmp_path: Path) -> None:
    done = answered("export", tmp_path / "cups.zip", "--category", "cup", "--data-dir", data_dir)
    assert (done["categories"], done["size"]) == (1, (tmp_path / "cups.zip").stat().st_size)
    brought = memory("import", tmp_path / "cups.zip", "--data-dir", tmp_path / "other")
    assert brought.exit_code == 0, brought.output
    assert "cup is " in brought.output
    again = answered("import", tmp_path / "cups.zip", "--data-dir", tmp_path / "other")
    assert (again["categories"], [each["name"] for each in again["duplicates"]]) == ([], ["cup"])
    assert "cup was here already" in memory("import", tmp_path / "cups.zip", "--data-dir", tmp_path / "other").output


def test_an_export_tells_what_it_leaves_out(data_dir: Path, tmp_path: Path) -> None:
    with Memory.open(data_dir) as stored, stored._connection.change() as db:
        db.execute("UPDATE instances SET cls = zeroblob(4) WHERE rowid = (SELECT min(rowid) FROM instances)")
    assert "without 1 damaged instances" in memory("export", tmp_path / "all.zip", "--data-dir", data_dir).output
    assert answered("export", tmp_path / "again.zip", "--data-dir", data_dir)["left_out"] == 1


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["export", "OUT", "--category", "mug"], "no category is called 'mug'"),
        (["import", "OUT"], "cannot read"),
    ],
)
def test_what_cannot_be_is_one_sentence(data_dir: Path, tmp_path: Path, words: list[str], says: str) -> None:
    failed = memory(*(str(tmp_path / "x.zip") if word == "OUT" else word for word in words), "--data-dir", data_dir)
    assert failed.exit_code == 1
    assert says in failed.output
    assert "Traceback" not in failed.output


@pytest.mark.parametrize("command", [["info"], ["list"], ["check"], ["reembed"], ["backup", "x"], ["export", "x"]])
def test_where_no_memory_is_none_is_made(tmp_path: Path, command: list[str]) -> None:
    failed = memory(*command, "--data-dir", tmp_path / "none")
    assert failed.exit_code == 1
    assert "no memory is in" in failed.output
    assert list(tmp_path.iterdir()) == []


def test_a_memory_is_read_but_not_changed_beside_the_service(data_dir: Path, tmp_path: Path) -> None:
    with Memory.open(data_dir):
        assert answered("check", "--data-dir", data_dir)["ok"]
        answered("export", tmp_path / "all.zip", "--data-dir", data_dir)
        for command in (["import", tmp_path / "all.zip"], ["reembed"]):
            refused = memory(*command, "--data-dir", data_dir)
            assert (refused.exit_code, "open in another process" in refused.output) == (1, True)


def test_another_backbone_computes_it_anew(
    tmp_path: Path, backbone: Backbone, look: Callable[..., Burst], monkeypatch: pytest.MonkeyPatch
) -> None:
    burst = look(views=2)
    encoded = Encoder(backbone).encode(burst)
    with Memory.open(tmp_path) as learnt:
        learnt.require_backbone("first", "first-1")
        learnt.categories.create(build_reference(encoded), burst, encoded)
    monkeypatch.setattr(backbones, "load_backbone", lambda *_, **__: backbone)
    done = answered("reembed", "--backbone", "colour", "--data-dir", tmp_path)
    assert (done["fingerprint"], done["categories"], done["instances"]) == ("colour-1", 1, 1)
    assert answered("info", "--data-dir", tmp_path)["backbone"] == "colour"
    assert "colour-1" in memory("reembed", "--data-dir", tmp_path).output

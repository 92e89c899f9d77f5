"""What is not in order in an archive is refused, and changes nothing."""

from __future__ import annotations

import io
import json
import math
import stat
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import InvalidInput, Unavailable
from core.evidence import merged, part_tokens
from store.folders import FileSum
from store.memory import Memory
from store.records import Category
from tests.store.archives import Entries, npz, packed, unpacked, with_entry, with_manifest
from tests.store.conftest import DIM, VIEWS


def nothing_changed(memory: Memory) -> bool:
    folder = memory.categories.root
    return memory.categories.all() == [] and memory.version == 1 and (not folder.exists() or list(folder.iterdir()) == [])


def test_an_entry_of_another_name_is_refused(second: Memory, archive: Path, tmp_path: Path) -> None:
    for name in ("../evil.png", "/etc/evil", "categories/../../evil", "categories\\..\\evil", "evil.txt"):
        with pytest.raises(InvalidInput, match="not in both"):
            second.import_archive(packed(tmp_path / "evil.zip", unpacked(archive) | {name: b""}))
    assert nothing_changed(second)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["all.zip", "evil.zip", "memory", "second"]


def test_a_file_of_another_name_is_refused(second: Memory, archive: Path, category: Category, tmp_path: Path) -> None:
    entries = unpacked(archive)
    picture = entries[f"categories/{category.id}/000_rgb.png"]
    for name in ("../000_rgb.png", "x/000_rgb.png", "evil.sh", "reference.npz/../../x.png", "000_rgb.png\n"):

        def add(manifest: dict, name: str = name) -> None:
            manifest["categories"][0]["files"][name] = {"size": len(picture), "sha256": FileSum.of(picture).sha256}

        evil = with_manifest(entries | {f"categories/{category.id}/{name}": picture}, add)
        with pytest.raises(InvalidInput, match="no file of a category"):
            second.import_archive(packed(tmp_path / "evil.zip", evil))
    assert nothing_changed(second)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["all.zip", "evil.zip", "memory", "second"]


def test_links_folders_and_devices_are_refused(second: Memory, archive: Path, tmp_path: Path) -> None:
    entries = unpacked(archive)
    for kind in (stat.S_IFLNK, stat.S_IFDIR, stat.S_IFIFO):
        with zipfile.ZipFile(tmp_path / "evil.zip", "w") as file:
            for index, (name, content) in enumerate(entries.items()):
                info = zipfile.ZipInfo(name)
                info.external_attr = ((kind if index == 0 else stat.S_IFREG) | 0o644) << 16
                file.writestr(info, content)
        with pytest.raises(InvalidInput, match="plain files only"):
            second.import_archive(tmp_path / "evil.zip")
    assert nothing_changed(second)


def test_compressed_entries_are_refused_unread(second: Memory, archive: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="compressed"):
        second.import_archive(packed(tmp_path / "evil.zip", unpacked(archive) | {"bomb": bytes(50_000_000)}, zipfile.ZIP_DEFLATED))
    assert nothing_changed(second)


def test_a_size_that_is_a_lie_is_refused(second: Memory, archive: Path, tmp_path: Path) -> None:
    content = bytearray(archive.read_bytes())
    first = content.rindex(b"PK\x01\x02")
    content[first + 20 : first + 28] = struct.pack("<II", 2**31, 2**31)
    (tmp_path / "evil.zip").write_bytes(content)
    with pytest.raises(InvalidInput, match="overlap"):
        second.import_archive(tmp_path / "evil.zip")
    assert nothing_changed(second)


def test_a_torn_archive_is_refused(second: Memory, archive: Path, tmp_path: Path) -> None:
    content = archive.read_bytes()
    for keep in (0.0, 0.3, 0.9, 0.999):
        (tmp_path / "torn.zip").write_bytes(content[: int(keep * len(content))])
        with pytest.raises(InvalidInput, match="archive"):
            second.import_archive(tmp_path / "torn.zip")
    assert nothing_changed(second)


def test_one_changed_bit_is_noticed(second: Memory, archive: Path, tmp_path: Path) -> None:
    entries = unpacked(archive)
    for name in entries:
        changed = bytearray(entries[name])
        changed[len(changed) // 2] ^= 1
        with pytest.raises(InvalidInput):
            second.import_archive(packed(tmp_path / "changed.zip", entries | {name: bytes(changed)}))
    assert nothing_changed(second)


def test_a_zip_file_without_a_manifest_is_refused(second: Memory, archive: Path, tmp_path: Path) -> None:
    entries = {name: content for name, content in unpacked(archive).items() if name != "manifest.json"}
    with pytest.raises(InvalidInput, match="onelook memory export"):
        second.import_archive(packed(tmp_path / "evil.zip", entries))
    assert nothing_changed(second)


def test_a_missing_archive_is_named(second: Memory, tmp_path: Path) -> None:
    with pytest.raises(Unavailable, match=r"none\.zip"):
        second.import_archive(tmp_path / "none.zip")


def npy_of(header: str, data: bytes) -> bytes:
    """A .npy with any header, in an npz."""
    padded = header.ljust(118 - 1) + "\n"
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        file.writestr("counts.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(padded)) + padded.encode() + data)
    return buffer.getvalue()


def evil_references() -> dict[str, bytes]:
    compressed = io.BytesIO()
    np.savez_compressed(compressed, counts=np.zeros(100_000))
    return {
        "pickled": npz(counts=np.array([{"a": 1}], dtype=object)),
        "compressed": compressed.getvalue(),
        "larger than it is": npy_of("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,)}", b""),
        "negative": npy_of("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -1)}", bytes(8)),
        "of nothing": npy_of("{'descr': '<U0', 'fortran_order': False, 'shape': (1000000000000,)}", b""),
        "no header": npy_of("__import__('os').system('true')", b""),
        "a header that ends early": npy_of("{'descr': '<f8', 'shape': (", b""),
        "not an npz": b"GARBAGE",
        "a zip of the future": npz(a=np.zeros(3)).replace(b"PK\x01\x02-\x03-", b"PK\x01\x02-\x03\xf0"),
        "without what a reference has": npz(a=np.zeros(3)),
    }


def test_arrays_that_are_not_plain_are_refused(second: Memory, archive: Path, category: Category, tmp_path: Path) -> None:
    entries = unpacked(archive)
    for kind, content in evil_references().items():
        evil = with_entry(entries, f"categories/{category.id}/reference.npz", content)
        with pytest.raises(InvalidInput, match="archive"):
            second.import_archive(packed(tmp_path / "evil.zip", evil))
        assert nothing_changed(second), kind


def test_a_reference_that_does_not_fit_its_views_is_refused(second: Memory, archive: Path, category: Category, tmp_path: Path) -> None:
    name = f"categories/{category.id}/reference.npz"
    entries = unpacked(archive)
    arrays = dict(np.load(io.BytesIO(entries[name])))
    for wrong in (
        {"fingerprint": np.array("fingerprint-b")},
        {"counts": arrays["counts"][:2]},
        {"extent_m": np.zeros(2)},
        {"K": np.zeros((3, 3, 3))},
    ):
        with pytest.raises(InvalidInput, match="cannot be read"):
            second.import_archive(packed(tmp_path / "evil.zip", with_entry(entries, name, npz(**arrays | wrong))))
    assert nothing_changed(second)


@pytest.mark.parametrize(
    ("field", "shape"), [("cloud_m", (5, 3)), ("world_from_object", (4, 4)), ("extent_m", (3,)), ("symmetries", (1, 3, 3))]
)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_reference_that_is_nowhere_is_refused(
    second: Memory, archive: Path, category: Category, tmp_path: Path, field: str, shape: tuple[int, ...], value: float
) -> None:
    name = f"categories/{category.id}/reference.npz"
    entries = unpacked(archive)
    arrays = dict(np.load(io.BytesIO(entries[name]))) | {field: np.full(shape, value)}
    with pytest.raises(InvalidInput, match=rf"{category.id} cannot be read .*{field} of reference\.npz is finite"):
        second.import_archive(packed(tmp_path / "evil.zip", with_entry(entries, name, npz(**arrays))))
    assert nothing_changed(second)


def test_a_picture_of_another_size_than_any_camera_s_is_refused(second: Memory, archive: Path, category: Category, tmp_path: Path) -> None:
    name = f"categories/{category.id}/000_rgb.png"
    entries = unpacked(archive)
    for size in ((0, 0), (100_000, 100_000)):
        picture = entries[name][:16] + struct.pack(">II", *size) + entries[name][24:]
        with pytest.raises(InvalidInput, match="megapixels"):
            second.import_archive(packed(tmp_path / "evil.zip", with_entry(entries, name, picture)))
    assert nothing_changed(second)


def test_cameras_that_are_no_cameras_are_refused(second: Memory, archive: Path, category: Category, tmp_path: Path) -> None:
    name = f"categories/{category.id}/cameras.json"
    entries = unpacked(archive)
    for wrong in (b"[]", b"{}", b'[{"K": 1}, {}, {}]', b"[" * 100_000, b"\xff", b'[{"depth_scale": "x"}, {}, {}]'):
        with pytest.raises(InvalidInput, match="cannot be read"):
            second.import_archive(packed(tmp_path / "evil.zip", with_entry(entries, name, wrong)))
    assert nothing_changed(second)


def test_tokens_must_be_numbers_of_the_reference_s_size(second: Memory, archive: Path, category: Category, tmp_path: Path) -> None:
    entries = unpacked(archive)
    name = f"tokens/{category.id}.npz"
    tokens = dict(np.load(io.BytesIO(entries[name])))
    for wrong in ({}, {**tokens, "000000_cls": tokens["000000_cls"][:-4]}, {**tokens, "000000_cls": np.full(96, 255, np.uint8)}):
        evil = with_entry(entries, name, npz(**wrong))
        blobs = b"".join(bytes(wrong.get(f"000000_{column}", b"")) for column in ("cls", "pooled"))

        def tell(manifest: dict, sha256: str = FileSum.of(blobs).sha256) -> None:
            manifest["categories"][0]["instances"][0]["tokens_sha256"] = sha256

        with pytest.raises(InvalidInput, match="cannot be read"):
            second.import_archive(packed(tmp_path / "evil.zip", with_manifest(evil, tell)))
    assert nothing_changed(second)


def of_version_1(entries: Entries, patches: bytes | None) -> Entries:
    """The same archive as the version before parts wrote it: with these patches of every instance, or none."""
    manifest = json.loads(entries["manifest.json"]) | {"version": 1}
    for part in manifest["categories"]:
        name = f"tokens/{part['id']}.npz"
        tokens = dict(np.load(io.BytesIO(entries[name])))
        for index, instance in enumerate(part["instances"]):
            del tokens[f"{index:06d}_parts"]
            if patches is not None:
                tokens[f"{index:06d}_patches"] = np.frombuffer(patches, np.uint8)
            blobs = bytes(tokens[f"{index:06d}_cls"]) + bytes(tokens[f"{index:06d}_pooled"]) + (patches or b"")
            instance["tokens_sha256"] = FileSum.of(blobs).sha256
        entries = entries | {name: npz(**tokens)}
        part["tokens"] = {"size": len(entries[name]), "sha256": FileSum.of(entries[name]).sha256}
    return entries | {"manifest.json": json.dumps(manifest).encode()}


def test_an_archive_of_an_earlier_version_brings_what_decisions_compare_now(
    second: Memory, archive: Path, encoded: EncodedBurst, tmp_path: Path
) -> None:
    second.import_archive(packed(tmp_path / "earlier.zip", of_version_1(unpacked(archive), None)))
    (first, *_) = second.instances.listed()
    assert np.array_equal(second.instances.parts([first.id])[first.id], part_tokens(encoded))
    assert second.check().ok


def test_patches_of_an_earlier_version_become_parts(second: Memory, archive: Path, tmp_path: Path) -> None:
    drawn = np.random.default_rng(0).normal(size=(VIEWS, 24, DIM)).astype(np.float16)
    second.import_archive(packed(tmp_path / "earlier.zip", of_version_1(unpacked(archive), drawn.tobytes())))
    (first, *_) = second.instances.listed()
    assert np.array_equal(second.instances.parts([first.id])[first.id], [merged(view) for view in drawn])
    assert second.check().ok


def test_another_number_of_parts_is_refused(second: Memory, archive: Path, category: Category, tmp_path: Path) -> None:
    entries = unpacked(archive)
    name = f"tokens/{category.id}.npz"
    tokens = dict(np.load(io.BytesIO(entries[name])))
    tokens["000000_parts"] = tokens["000000_parts"][: VIEWS * DIM * 2]
    blobs = b"".join(bytes(tokens[f"000000_{column}"]) for column in ("cls", "pooled", "parts"))

    def tell(manifest: dict) -> None:
        manifest["categories"][0]["instances"][0]["tokens_sha256"] = FileSum.of(blobs).sha256

    with pytest.raises(InvalidInput, match="parts a view"):
        second.import_archive(packed(tmp_path / "other.zip", with_manifest(with_entry(entries, name, npz(**tokens)), tell)))
    assert nothing_changed(second)


def goal(manifest: dict, scale: float = 1, rotation: object = ((1, 0, 0), (0, 1, 0), (0, 0, 1)), translation: object = (0, 0, 0.5)) -> None:
    pose = {"scale": scale, "rotation": rotation, "translation": translation}
    manifest["categories"][0]["goals"][0].update(target_from_reference=json.dumps(pose))


CHANGES: dict[str, Callable[[dict], object]] = {
    "another format": lambda manifest: manifest.update(format="else"),
    "a later version": lambda manifest: manifest.update(version=3),
    "nothing": lambda manifest: manifest.clear(),
    "no categories": lambda manifest: manifest.update(categories=[]),
    "a field nobody knows": lambda manifest: manifest.update(more=1),
    "an id that is a path": lambda manifest: manifest["categories"][0].update(id="../x"),
    "the same id twice": lambda manifest: manifest["categories"].append(manifest["categories"][0]),
    "no instances": lambda manifest: manifest["categories"][0].update(instances=[]),
    "an instance that came by magic": lambda manifest: manifest["categories"][0]["instances"][0].update(how="magic"),
    "a goal that is no pose": lambda manifest: manifest["categories"][0]["goals"][0].update(target_from_reference="{}"),
    "a goal that stretches": lambda manifest: goal(manifest, rotation=[[1, 0, 0], [0, 1, 0], [0, 0, 2]]),
    "a goal whose rotation shrinks": lambda manifest: goal(manifest, 2, [[0.5, 0, 0], [0, 0.5, 0], [0, 0, 0.5]]),
    "a goal that is nowhere": lambda manifest: goal(manifest, translation=[0, 0, math.inf]),
    "a goal on a line": lambda manifest: goal(manifest, translation=[0.5]),
    "a goal with rotations": lambda manifest: goal(manifest, rotation=[[[1, 0, 0], [0, 1, 0], [0, 0, 1]]]),
    "no arrays": lambda manifest: manifest["categories"][0]["files"].pop("reference.npz"),
    "a time that never was": lambda manifest: manifest["categories"][0].update(created_at="2026-02-30T12:00:00.000+00:00"),
}


def test_a_manifest_that_is_not_in_order_is_refused(second: Memory, archive: Path, tmp_path: Path) -> None:
    entries = unpacked(archive)
    for kind, change in CHANGES.items():
        with pytest.raises(InvalidInput, match="archive"):
            second.import_archive(packed(tmp_path / "evil.zip", with_manifest(entries, change)))
        assert nothing_changed(second), kind


def test_one_bad_category_keeps_the_good_ones_out_too(second: Memory, archive: Path, other: Category, tmp_path: Path) -> None:
    evil = with_entry(unpacked(archive), f"categories/{other.id}/cameras.json", b"[]")
    with pytest.raises(InvalidInput, match=other.id):
        second.import_archive(packed(tmp_path / "evil.zip", evil))
    assert nothing_changed(second)

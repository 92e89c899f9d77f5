"""Arrays come back as they were written, or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from core.errors import Unavailable
from store.arrays import read_arrays, tokens_from_blob, tokens_to_blob, write_arrays


def test_arrays_come_back_with_type_and_shape(tmp_path: Path) -> None:
    arrays = {"half": np.linspace(0, 1, 6).astype(np.float16).reshape(2, 3), "text": np.array("abc"), "none": np.zeros((0, 3))}
    checksum = write_arrays(tmp_path / "a.npz", arrays)
    found = read_arrays(tmp_path / "a.npz", checksum)
    assert {name: (each.dtype, each.shape) for name, each in found.items()} == {n: (a.dtype, a.shape) for n, a in arrays.items()}
    assert all(np.array_equal(found[name], arrays[name]) for name in arrays)


def test_objects_are_never_pickled(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="pickle|object"):
        write_arrays(tmp_path / "a.npz", {"things": np.array([{"a": 1}], dtype=object)})


def test_one_changed_byte_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    checksum = write_arrays(path, {"a": np.arange(10)})
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(Unavailable, match="damaged"):
        read_arrays(path, checksum)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(Unavailable, match=r"gone\.npz"):
        read_arrays(tmp_path / "gone.npz", "0" * 64)


def test_tokens_survive_a_blob_exactly() -> None:
    tokens = np.random.default_rng(0).normal(size=(3, 7)).astype(np.float32)
    assert np.array_equal(tokens_from_blob(tokens_to_blob(tokens), 3), tokens)

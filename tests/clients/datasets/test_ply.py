"""Vertices of PLY files, of those that are none, and of damaged ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clients.datasets.ply import read_vertices
from core.errors import InvalidInput

PROPERTIES = b"property float x\nproperty float y\nproperty float z\nproperty uchar red\n"


def test_vertices_are_read_of_text_and_of_either_order_of_bytes(tmp_path: Path) -> None:
    file, points = tmp_path / "cloud.ply", np.array([[1.0, -2, 3], [0.5, 0, 4]])
    row = [("place", "f4", 3), ("red", "u1")]
    packed = np.array([(tuple(point), 7) for point in points], dtype=row)
    bodies = {
        b"ascii": b"1 -2 3 7\n0.5 0 4 7\n",
        b"binary_little_endian": packed.tobytes(),
        b"binary_big_endian": packed.astype(np.dtype(row).newbyteorder(">")).tobytes(),
    }
    for layout, body in bodies.items():
        file.write_bytes(b"ply\nformat " + layout + b" 1.0\nelement vertex 2\n" + PROPERTIES + b"end_header\n" + body)
        np.testing.assert_array_equal(read_vertices(file), points)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is not a PLY file whose first element is vertex"),
        (b"ply\nformat ascii 1.0\nelement face 1\nend_header\n", "is not a PLY file whose first element is vertex"),
        (b"ply\nformat ascii 1.0\nelement\nend_header\n", "is not a PLY file whose first element is vertex"),
        (b"ply\nelement vertex 1\n" + PROPERTIES + b"end_header\n", "cannot be read"),
        (b"ply\nformat ascii 1.0\nelement vertex\n" + PROPERTIES + b"end_header\n", "cannot be read"),
        (b"ply\nformat ascii 1.0\nelement vertex two\n" + PROPERTIES + b"end_header\n", "cannot be read"),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex 9\n" + PROPERTIES + b"end_header\n....", "cannot be read"),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex " + b"9" * 20 + b"\n" + PROPERTIES + b"end_header\n", "cannot be read"),
    ],
)
def test_a_file_without_readable_vertices_is_named(tmp_path: Path, content: bytes, says: str) -> None:
    file = tmp_path / "cloud.ply"
    file.write_bytes(content)
    with pytest.raises(InvalidInput, match=says) as caught:
        read_vertices(file)
    assert caught.value.field == str(file)

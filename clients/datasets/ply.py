"""Vertices of PLY files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.errors import InvalidInput
from core.views import FloatArray

TYPES = {
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("int", "int32"), "i4"),
}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}


def read_vertices(path: Path) -> FloatArray:
    """x, y and z of every vertex, shape (P, 3). Raises InvalidInput where the file is no PLY that begins with its vertices."""
    content = path.read_bytes()
    head, mark, body = content.partition(b"end_header\n")
    lines = [line.split() for line in head.decode("ascii", "replace").splitlines()]
    elements = [line[1:] for line in lines if line[:1] == ["element"]]
    if not mark or lines[:1] != [["ply"]] or not elements or elements[0][:1] != ["vertex"]:
        raise InvalidInput(str(path), "is not a PLY file whose first element is vertex")
    try:
        count = int(elements[0][1])
        layout = next((line[1] for line in lines if line[:1] == ["format"]), "")
        start = lines.index(["element", *elements[0]]) + 1
        end = lines.index(["element", *elements[1]]) if len(elements) > 1 else len(lines)
        properties = [(line[-1], line[1]) for line in lines[start:end] if line[:1] == ["property"]]
        if layout == "ascii":
            table = np.loadtxt(body.decode("ascii").splitlines()[:count], ndmin=2)
            return np.stack([table[:, [name for name, _ in properties].index(axis)] for axis in "xyz"], axis=1)
        kind = np.dtype([(name, ORDERS[layout] + TYPES[number]) for name, number in properties])
        vertices = np.frombuffer(body, kind, count)
        return np.stack([vertices[axis].astype(float) for axis in "xyz"], axis=1)
    except (IndexError, KeyError, OverflowError, ValueError) as error:
        raise InvalidInput(str(path), f"is a PLY file whose vertices cannot be read ({error})") from None

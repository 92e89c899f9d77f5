"""A user's meshes: OBJ and GLB with a texture, PLY with colours."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from clients.simulator.raycast.model import Model
from clients.simulator.raycast.user_meshes import find_models, load_model
from core.errors import InvalidInput
from core.views import FloatArray

QUAD = np.array([(0, 0, 0), (0.4, 0, 0), (0.4, 0, 0.3), (0, 0, 0.3)], np.float32)
UV = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)


def picture() -> bytes:
    """Red above, green below, PNG."""
    image = np.zeros((64, 64, 3), np.uint8)
    image[:32, :, 2], image[32:, :, 1] = 255, 255
    return bytes(cv2.imencode(".png", image)[1])


def obj(folder: Path) -> Path:
    (folder / "picture.png").write_bytes(picture())
    (folder / "a.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd picture.png\n")
    lines = ["mtllib a.mtl", "usemtl m"]
    lines += [f"v {x} {y} {z}" for x, y, z in QUAD] + [f"vt {u} {v}" for u, v in UV] + ["f 1/1 2/2 3/3", "f 1/1 3/3 4/4"]
    (folder / "a.obj").write_text("\n".join(lines))
    return folder / "a.obj"


def glb(folder: Path) -> Path:
    """As glTF has it: y up, z to the front, and a picture's origin at its upper left."""
    upright = QUAD[:, [0, 2, 1]]
    parts = [
        upright.tobytes(),
        (np.array([[0, 1]]) + UV * [1, -1]).astype(np.float32).tobytes(),
        np.array([0, 1, 2, 0, 2, 3], np.uint16).tobytes(),
        picture(),
    ]
    parts = [part + b"\0" * (-len(part) % 4) for part in parts]
    starts = np.cumsum([0, *(len(part) for part in parts)]).tolist()
    scene = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 4,
                "type": "VEC3",
                "min": upright.min(axis=0).tolist(),
                "max": upright.max(axis=0).tolist(),
            },
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": len(part)} for start, part in zip(starts, parts)],
        "buffers": [{"byteLength": starts[-1]}],
    }
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", starts[-1], 0x004E4942) + b"".join(parts)
    (folder / "b.glb").write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body)
    return folder / "b.glb"


def ply(folder: Path) -> Path:
    colours = [(255, 0, 0) if z > 0 else (0, 255, 0) for _, _, z in QUAD]
    head = "ply\nformat ascii 1.0\nelement vertex 4\n" + "".join(f"property float {axis}\n" for axis in "xyz")
    head += "".join(f"property uchar {colour}\n" for colour in ("red", "green", "blue"))
    head += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, (*place, *colour))) for place, colour in zip(QUAD.tolist(), colours)]
    (folder / "c.ply").write_text(head + "\n".join([*rows, "3 0 1 2", "3 0 2 3"]) + "\n")
    return folder / "c.ply"


def colours_at(model: Model, above: bool) -> FloatArray:
    height = model.mesh.vertices[:, 2]
    chosen = height > 0.2 if above else height < -0.2
    return model.mesh.colours[chosen].mean(axis=0)


@pytest.mark.parametrize("write", [obj, glb, ply])
def test_a_mesh_keeps_its_colours_and_stands_upright(tmp_path: Path, write: Callable[[Path], Path]) -> None:
    folder = tmp_path / "sign"
    folder.mkdir()

    model = load_model(write(folder))
    assert model.category == "sign"
    assert model.size_m == pytest.approx(0.5)
    np.testing.assert_allclose(np.sort(np.ptp(model.mesh.vertices, axis=0)), [0, 0.6, 0.8], atol=1e-6)
    assert np.ptp(model.mesh.vertices[:, 2]) == pytest.approx(0.6)
    np.testing.assert_allclose(colours_at(model, above=True), (1, 0, 0), atol=0.05)
    np.testing.assert_allclose(colours_at(model, above=False), (0, 1, 0), atol=0.05)


def test_a_folder_is_read_whole_and_its_sizes_made_sense_of(tmp_path: Path) -> None:
    (tmp_path / "sign").mkdir()
    obj(tmp_path / "sign")
    file = ply(tmp_path / "sign")
    file.write_text(file.read_text().replace("0.4", "400").replace("0.3", "300"))
    assert [(model.name, model.size_m) for model in find_models(tmp_path)] == [
        ("sign/a", pytest.approx(0.5)),
        ("sign/c", pytest.approx(0.3)),
    ]


def test_what_holds_no_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"no .*\.glb"):
        find_models(tmp_path)
    with pytest.raises(InvalidInput, match="is no file"):
        load_model(tmp_path / "x" / "none.obj")


def test_two_meshes_of_one_name_are_named(tmp_path: Path) -> None:
    first = obj(tmp_path)
    twin = first.with_suffix(".ply")
    ply(tmp_path).rename(twin)
    with pytest.raises(InvalidInput, match=rf"{first.name} and .*{twin.name} are both {tmp_path.name}/a; leave one out"):
        find_models(tmp_path)

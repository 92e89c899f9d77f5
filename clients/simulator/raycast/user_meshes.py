"""Meshes of a user's own as objects of the rendered world: OBJ, GLB and PLY, with textures or colours at vertices."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from clients.simulator.raycast.mesh import Mesh
from clients.simulator.raycast.model import Model
from core.errors import InvalidInput
from core.views import FloatArray

SUFFIXES = (".obj", ".glb", ".ply")
DENSE = 60_000
"""Triangles up to which a textured mesh is divided, since colours are kept at vertices."""
LARGEST_M, SMALLEST_M = 0.9, 0.05
"""Diagonals taken as they are; other sizes cannot be metres of something on a table and are brought to USUAL_M."""
USUAL_M = 0.3


def find_models(folder: Path) -> list[Model]:
    """Every mesh below `folder`, CATEGORY/INSTANCE.obj, .glb or .ply, sorted by path.

    Raises InvalidInput where there is none, or two are of one name.
    """
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    if not files:
        raise InvalidInput("meshes", f"no {', '.join(SUFFIXES)} below {folder}; expected CATEGORY/INSTANCE{SUFFIXES[0]}")
    first: dict[tuple[str, str], Path] = {}
    for file in files:
        twin = first.setdefault((file.parent.name, file.stem), file)
        if twin != file:
            raise InvalidInput("meshes", f"{twin} and {file} are both {file.parent.name}/{file.stem}; leave one out, or rename it")
    return [load_model(file) for file in files]


def load_model(file: Path) -> Model:
    """A mesh file as an object; its folder's name is its category. OBJ and PLY have z up and x to the front, GLB y up and z to the front.

    Raises InvalidInput where it holds no triangles.
    """
    mesh = _read(file)
    if file.suffix.lower() == ".glb":
        mesh = mesh.turned("x", 90).turned("z", 90)
    low, high = mesh.bounds
    size = float(np.linalg.norm(high - low))
    size_m = size if SMALLEST_M <= size <= LARGEST_M else USUAL_M
    return Model(file.parent.name, file.stem, mesh.unit(), size_m)


def _read(file: Path) -> Mesh:
    if not file.is_file():
        raise InvalidInput("meshes", f"{file} is no file")
    if file.suffix.lower() == ".ply":
        return _coloured(o3d.io.read_triangle_mesh(file), file)
    model = o3d.io.read_triangle_model(str(file))  # type: ignore[arg-type,unused-ignore]  # its stub names one overload of two
    if not model.meshes:
        raise InvalidInput("meshes", f"{file} holds no mesh that Open3D can read; export it again, as triangles")
    return Mesh.join([_textured(part.mesh, model.materials[part.material_idx], file) for part in model.meshes])


def _coloured(mesh: o3d.geometry.TriangleMesh, file: Path) -> Mesh:
    plain = Mesh.plain(np.asarray(mesh.vertices), _triangles(mesh, file))
    return replace(plain, colours=np.asarray(mesh.vertex_colors)) if mesh.has_vertex_colors() else plain


def _textured(mesh: o3d.geometry.TriangleMesh, material: o3d.visualization.rendering.MaterialRecord, file: Path) -> Mesh:
    """Colours of a material at vertices; those of a picture where it has one."""
    triangles = _triangles(mesh, file)
    tint = np.asarray(material.base_color)[:3]
    if material.albedo_img is None or not mesh.has_triangle_uvs():
        coloured = _coloured(mesh, file)
        return replace(
            coloured, colours=coloured.colours * tint if mesh.has_vertex_colors() else np.broadcast_to(tint, coloured.colours.shape)
        )
    # A vertex may be at several places of the picture, so triangles are taken apart, and divided until the picture's detail fits.
    corners = np.concatenate([np.asarray(mesh.vertices)[triangles], np.asarray(mesh.triangle_uvs).reshape(-1, 3, 2)], axis=2)
    while 4 * len(corners) <= DENSE:
        corners = _divided(corners)
    flat = corners.reshape(-1, 5)
    plain = Mesh.plain(flat[:, :3], np.arange(len(flat)).reshape(-1, 3))
    return replace(plain, colours=_looked_up(np.asarray(material.albedo_img), flat[:, 3:]) * tint)


def _triangles(mesh: o3d.geometry.TriangleMesh, file: Path) -> NDArray[np.intp]:
    triangles = np.asarray(mesh.triangles).astype(np.intp)
    if not len(triangles):
        raise InvalidInput("meshes", f"{file} holds no triangles that Open3D can read; export it again, as triangles")
    return triangles


def _divided(corners: FloatArray) -> FloatArray:
    """Every triangle, shape (T, 3, any), cut into four."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return np.concatenate([np.stack(parts, axis=1) for parts in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])


def _looked_up(picture: NDArray[np.uint8], uv: FloatArray) -> FloatArray:
    """Colours, shape (V, 3), of places in a picture whose origin is at its lower left; it repeats itself."""
    height, width = picture.shape[:2]
    column = (uv[:, 0] % 1) * (width - 1)
    row = (1 - uv[:, 1] % 1) * (height - 1)
    channels = [map_coordinates(picture[..., channel].astype(np.float32), [row, column], order=1, mode="nearest") for channel in range(3)]
    return np.stack(channels, axis=1) / 255

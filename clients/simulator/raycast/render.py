"""What an ideal camera sees of a lit scene: colour, depth, and which object each pixel shows.

Letters: H, W pixels; Q rectangles of the room; N places where rays meet a surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from clients.simulator.raycast.light import irradiance
from clients.simulator.raycast.mesh import Mesh
from clients.simulator.raycast.room import TEXELS, Room
from core.views import Camera, FloatArray

LIT_TEXELS = (144, 8, 8, 8, 8, 32, 12, 12, 12, 12)
"""Places a side at which the light on each rectangle is computed: many on the table, where shadows fall."""
SUBSAMPLES = ((0.0, 0.36), (0.31, -0.18), (-0.31, -0.18))
"""Further rays of a pixel that shows an object or an edge, (x, y) off its centre."""
SHININESS = 60.0
EXPOSURE = 0.85
GAMMA = 2.2
ROOM_ID = 0
"""Geometry of the room; objects follow in order."""


@dataclass(frozen=True, eq=False)
class Rendered:
    """One ideal picture."""

    rgb: NDArray[np.float32]
    """sRGB, 0 to 1, shape (H, W, 3)."""
    depth_m: NDArray[np.float32]
    """z-depth, shape (H, W); infinite where nothing is."""
    shows: NDArray[np.int64]
    """Index of the object that a pixel's centre shows, −1 for the room, shape (H, W)."""
    slant: NDArray[np.float32]
    """Cosine between the ray and the surface, shape (H, W)."""


class LitScene:
    """A room and meshes in its frame, lit once, to be looked at from anywhere."""

    def __init__(self, room: Room, meshes: Sequence[Mesh]) -> None:
        self._scene = o3d.t.geometry.RaycastingScene()
        self._room = room
        self._scene.add_triangles(*_as_tensors(*_room_triangles(room)))
        for mesh in meshes:
            self._scene.add_triangles(*_as_tensors(mesh.vertices, mesh.triangles))
        self._pictures = np.concatenate([self._lit_picture(index) for index in range(len(room.quads))])
        joined = Mesh.join(meshes) if meshes else Mesh.plain(np.zeros((1, 3)), np.zeros((1, 3), int))
        self._triangles = joined.triangles
        self._first_triangle = np.cumsum([0, *(len(mesh.triangles) for mesh in meshes)])
        self._normals = np.concatenate([mesh.normals for mesh in meshes] or [np.zeros((1, 3))]).astype(np.float32)
        light = irradiance(self._scene, room, joined.vertices, self._normals)
        self._radiance = (joined.colours**GAMMA * light).astype(np.float32)
        self._gloss = joined.gloss.astype(np.float32)

    def render(self, camera: Camera, size: tuple[int, int]) -> Rendered:
        """What `camera` sees, in (H, W) pixels."""
        rows, columns = np.mgrid[: size[0], : size[1]]
        pixels = np.stack([columns.ravel(), rows.ravel()], axis=-1).astype(np.float32)
        rays = _rays(camera, pixels)
        hit = self._cast(rays)
        geometry = hit["geometry_ids"].astype(np.int64)
        shows = np.where(geometry == _INVALID, -1, geometry - 1).reshape(size)
        linear = self._shade(rays, hit)
        fine = np.flatnonzero(_needs_more(shows, hit["t_hit"].reshape(size)).ravel())
        if len(fine):
            total = linear[fine]
            for offset in SUBSAMPLES:
                more = _rays(camera, pixels[fine] + np.array(offset, np.float32))
                total += self._shade(more, self._cast(more))
            linear[fine] = total / (1 + len(SUBSAMPLES))
        ahead = rays[:, 3:]
        slant = np.abs(np.einsum("ni,ni->n", hit["primitive_normals"], ahead)) / np.sqrt(np.einsum("ni,ni->n", ahead, ahead))
        rgb = _encode(linear * np.float32(EXPOSURE)).reshape(*size, 3)
        return Rendered(rgb, hit["t_hit"].reshape(size), shows, slant.reshape(size))

    def _cast(self, rays: FloatArray) -> dict[str, NDArray[np.float32]]:
        answer = self._scene.cast_rays(o3d.core.Tensor.from_numpy(rays))
        return {name: answer[name].numpy() for name in ("t_hit", "geometry_ids", "primitive_ids", "primitive_uvs", "primitive_normals")}

    def _shade(self, rays: FloatArray, hit: dict[str, NDArray[np.float32]]) -> FloatArray:
        """Linear light towards the camera, shape (N, 3)."""
        geometry = hit["geometry_ids"]
        linear = np.zeros((len(rays), 3), np.float32)
        room = np.flatnonzero(geometry == ROOM_ID)
        linear[room] = self._shade_room(hit["primitive_ids"][room], hit["primitive_uvs"][room])
        objects = np.flatnonzero((geometry != ROOM_ID) & (geometry != _INVALID))
        if len(objects):
            part = {name: value[objects] for name, value in hit.items()}
            linear[objects] = self._shade_objects(rays[objects], part)
        return linear

    def _shade_room(self, primitive: FloatArray, uv: FloatArray) -> FloatArray:
        """Every rectangle is two triangles; their barycentrics give the place in its picture."""
        quad, second = (primitive // 2).astype(np.float32), primitive % 2 == 1
        across = np.where(second, uv[:, 0], uv.sum(axis=1))
        along = np.where(second, uv.sum(axis=1), uv[:, 1])
        column = across * (TEXELS - 1)
        row = along * (TEXELS - 1) + quad * TEXELS
        picked = np.empty((len(quad), 3), np.float32)
        for start in range(0, len(quad), _REMAP_ROWS):  # OpenCV's remap takes at most 32767 rows
            chosen = slice(start, start + _REMAP_ROWS)
            picked[chosen] = cv2.remap(
                self._pictures, column[chosen].astype(np.float32), row[chosen].astype(np.float32), cv2.INTER_LINEAR
            ).reshape(-1, 3)
        return picked

    def _shade_objects(self, rays: FloatArray, hit: dict[str, NDArray[np.float32]]) -> FloatArray:
        first = self._first_triangle[hit["geometry_ids"].astype(np.int64) - 1]
        corners = self._triangles[first + hit["primitive_ids"]]
        u, v = hit["primitive_uvs"][:, :1], hit["primitive_uvs"][:, 1:]
        weights = (1 - u - v, u, v)

        def at(values: NDArray[np.float32]) -> NDArray[np.float32]:
            return np.asarray(weights[0] * values[corners[:, 0]] + weights[1] * values[corners[:, 1]] + weights[2] * values[corners[:, 2]])

        linear, gloss = at(self._radiance), at(self._gloss[:, None])
        shiny = np.flatnonzero(gloss[:, 0] > 0.05)
        if len(shiny):
            corners, weights = corners[shiny], (weights[0][shiny], weights[1][shiny], weights[2][shiny])
            normals = _unit(at(self._normals))
            linear[shiny] += gloss[shiny] * self._mirrored(rays[shiny], hit["t_hit"][shiny], normals)
        return linear

    def _mirrored(self, rays: NDArray[np.float32], t_hit: NDArray[np.float32], normals: NDArray[np.float32]) -> NDArray[np.float32]:
        """Highlights of the lamps, and a sheen where a surface is seen at a slant."""
        back = _unit(-rays[:, 3:])
        places = rays[:, :3] + t_hit[:, None] * rays[:, 3:]
        facing = np.abs(np.einsum("ni,ni->n", normals, back)).clip(0, 1)
        total = (0.05 + 0.35 * (1 - facing) ** 5)[:, None] * self._room.sky.astype(np.float32)
        for light in self._room.lights:
            towards = _unit(light.points.mean(axis=0).astype(np.float32) - places)
            alike = np.einsum("ni,ni->n", normals, _unit(towards + back)).clip(0)
            total += cv2.pow(alike, SHININESS).reshape(-1, 1) * (0.35 * light.power).astype(np.float32)
        return total

    def _lit_picture(self, index: int) -> FloatArray:
        quad, count = self._room.quads[index], LIT_TEXELS[index]
        points = quad.points(count)
        light = irradiance(self._scene, self._room, points, np.broadcast_to(quad.normal, points.shape)).reshape(count, count, 3)
        return np.asarray(quad.picture**GAMMA * cv2.resize(light, (TEXELS, TEXELS), interpolation=cv2.INTER_CUBIC).clip(0), np.float32)


_INVALID = o3d.t.geometry.RaycastingScene.INVALID_ID
_REMAP_ROWS = 32_000
_LUT = (np.linspace(0, 1, 4096) ** (1 / GAMMA)).astype(np.float32)


def _encode(linear: FloatArray) -> NDArray[np.float32]:
    """sRGB of linear light, the brightest rolled off softly."""
    rolled = np.where(linear > 0.8, 0.8 + 0.2 * (1 - np.exp(-(linear - 0.8) / 0.2)), linear)
    return np.asarray(_LUT[(rolled * 4095).clip(0, 4095).astype(np.int32)])


def _unit(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(vectors / np.sqrt(np.einsum("ni,ni->n", vectors, vectors)).clip(1e-6)[:, None])


def _needs_more(shows: NDArray[np.int64], depth: FloatArray) -> NDArray[np.bool_]:
    """Pixels that show an object, and those beside an edge."""
    jump = np.zeros(shows.shape, np.uint8)
    for axis in (0, 1):
        step = np.abs(np.diff(np.where(np.isfinite(depth), depth, 0), axis=axis)) > 0.03
        where = [slice(None), slice(None)]
        where[axis] = slice(0, -1)
        jump[tuple(where)] |= step
    near = cv2.dilate(((shows >= 0) | (jump > 0)).astype(np.uint8), np.ones((3, 3), np.uint8))
    return np.asarray(near > 0)


def _rays(camera: Camera, pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Rays whose parameter is z-depth, shape (N, 6), through pixels (x, y), shape (N, 2)."""
    rotation, K = camera.world_from_camera[:3, :3], camera.K
    inverse = (rotation @ np.linalg.inv(K)).astype(np.float32)
    rays = np.empty((len(pixels), 6), np.float32)
    rays[:, :3] = camera.world_from_camera[:3, 3]
    x, y = np.ascontiguousarray(pixels.T)
    for axis in range(3):
        rays[:, 3 + axis] = inverse[axis, 0] * x + inverse[axis, 1] * y + inverse[axis, 2]
    return rays


def _room_triangles(room: Room) -> tuple[FloatArray, NDArray[np.intp]]:
    corners = np.concatenate(
        [
            np.stack([quad.corner, quad.corner + quad.across, quad.corner + quad.across + quad.along, quad.corner + quad.along])
            for quad in room.quads
        ]
    )
    first = 4 * np.arange(len(room.quads), dtype=np.intp)[:, None]
    triangles = np.stack([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])], axis=1)
    return np.asarray(corners), triangles.reshape(-1, 3)


def _as_tensors(vertices: FloatArray, triangles: NDArray[np.intp]) -> tuple[o3d.core.Tensor, o3d.core.Tensor]:
    return o3d.core.Tensor.from_numpy(vertices.astype(np.float32)), o3d.core.Tensor.from_numpy(triangles.astype(np.uint32))

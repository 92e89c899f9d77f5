"""Triangle meshes with a colour at every vertex: what all objects of the rendered world are made of.

Letters: V vertices, T triangles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from core.views import FloatArray

Colour = tuple[float, float, float]
"""Red, green and blue reflectance as displays encode it (sRGB), 0 to 1."""
Paint = Colour | Callable[[FloatArray], FloatArray]
"""One colour, or colours, shape (V, 3), of points, shape (V, 3)."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """See module."""

    vertices: FloatArray
    """Shape (V, 3)."""
    triangles: NDArray[np.intp]
    """Indices of vertices, shape (T, 3), counter-clockwise seen from outside."""
    colours: FloatArray
    """sRGB, 0 to 1, shape (V, 3)."""
    gloss: FloatArray
    """How strongly a surface mirrors the lights, 0 to 1, shape (V,)."""

    @staticmethod
    def plain(vertices: FloatArray, triangles: NDArray[np.intp]) -> Mesh:
        """Grey and dull."""
        return Mesh(vertices, triangles, np.full((len(vertices), 3), 0.7), np.zeros(len(vertices)))

    @staticmethod
    def join(parts: Sequence[Mesh]) -> Mesh:
        """All parts as one; they may reach into each other."""
        offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
        return Mesh(
            np.concatenate([part.vertices for part in parts]),
            np.concatenate([part.triangles + offset for part, offset in zip(parts, offsets)]),
            np.concatenate([part.colours for part in parts]),
            np.concatenate([part.gloss for part in parts]),
        )

    def painted(self, paint: Paint, gloss: float = 0.15) -> Mesh:
        """The mesh in new colours."""
        colours = np.asarray(paint(self.vertices)) if callable(paint) else np.broadcast_to(paint, self.vertices.shape)
        return replace(self, colours=np.clip(colours, 0, 1), gloss=np.full(len(self.vertices), gloss))

    def moved(self, offset: Sequence[float] | FloatArray) -> Mesh:
        """Shifted by `offset`, shape (3,)."""
        return replace(self, vertices=self.vertices + np.asarray(offset))

    def scaled(self, factors: float | Sequence[float] | FloatArray) -> Mesh:
        """Stretched about the origin by one factor or one an axis, all positive."""
        return replace(self, vertices=self.vertices * np.asarray(factors))

    def turned(self, axis: str, angle_deg: float) -> Mesh:
        """Turned about an axis (`x`, `y` or `z`) through the origin."""
        return replace(self, vertices=self.vertices @ rotation_about(axis, angle_deg).T)

    def mirrored(self, axis: int) -> Mesh:
        """Its mirror image in the plane through the origin across `axis`."""
        signs = np.ones(3)
        signs[axis] = -1
        return replace(self, vertices=self.vertices * signs, triangles=self.triangles[:, ::-1])

    @property
    def normals(self) -> FloatArray:
        """Unit normals at the vertices, means of the triangles' by area, shape (V, 3)."""
        corners = self.vertices[self.triangles]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        summed = np.stack(
            [np.bincount(self.triangles.ravel(), np.repeat(across[:, axis], 3), len(self.vertices)) for axis in range(3)], axis=1
        )
        return np.asarray(summed / np.maximum(np.linalg.norm(summed, axis=1, keepdims=True), 1e-12))

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and largest corner, each of shape (3,)."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    def unit(self) -> Mesh:
        """Moved and scaled so that the bounding box has its centre at the origin and a diagonal of 1."""
        low, high = self.bounds
        return self.moved(-(low + high) / 2).scaled(1 / float(np.linalg.norm(high - low)))


def rotation_about(axis: str, angle_deg: float) -> FloatArray:
    """Rotation matrix, shape (3, 3), about a coordinate axis."""
    index = "xyz".index(axis)
    cosine, sine = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    first, second = (index + 1) % 3, (index + 2) % 3
    matrix = np.eye(3)
    matrix[first, first] = matrix[second, second] = cosine
    matrix[first, second], matrix[second, first] = -sine, sine
    return matrix


def turns(count: int) -> tuple[FloatArray, ...]:
    """The rotations about z by multiples of a `count`-th of a circle, identity left out, each of shape (3, 3)."""
    return tuple(rotation_about("z", 360 * step / count) for step in range(1, count))

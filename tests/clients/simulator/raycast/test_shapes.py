"""Solids: closed, the right way out, and of the volume that they should have."""

from __future__ import annotations

import numpy as np
import pytest

from clients.simulator.raycast.mesh import Mesh, rotation_about, turns
from clients.simulator.raycast.shapes import box, ellipsoid, evenly, lathe, prism, rounded_rectangle, spline, tube


def volume(mesh: Mesh) -> float:
    """Signed: positive where triangles run counter-clockwise seen from outside."""
    corners = mesh.vertices[mesh.triangles]
    return float(np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (box((1, 2, 3)), 6.0),
        (box((1, 1, 1), radius=0.5, detail=2), np.pi / 6),
        (ellipsoid((1, 2, 0.5)), 4 / 3 * np.pi),
        (lathe([(0, 0), (1, 0), (1, 2), (0, 2)]), 2 * np.pi),
        (tube([(0, 0, 0), (0, 0, 3)], 0.5, sides=64), np.pi * 0.25 * 3),
        (prism([(0, 0), (2, 0), (2, 1), (0, 1)], 0.5), 1.0),
        (box((1, 2, 3)).mirrored(0).turned("y", 33).moved((5, 0, 1)).scaled((1, 1, 2)), 12.0),
    ],
)
def test_solids_have_their_volume(mesh: Mesh, expected: float) -> None:
    assert volume(mesh) == pytest.approx(expected, rel=0.04)


def test_a_bent_tube_keeps_its_radius() -> None:
    angle = np.linspace(0, np.pi, 40)
    arc = np.stack([np.cos(angle), np.zeros(40), np.sin(angle)], axis=1)
    vertices = tube(arc, 0.1).vertices
    from_axis = np.hypot(np.hypot(vertices[:, 0], vertices[:, 2]) - 1, vertices[:, 1])
    assert from_axis.max() == pytest.approx(0.1, rel=0.02)


def test_normals_of_a_ball_point_away_from_its_middle() -> None:
    ball = ellipsoid((1, 1, 1))
    assert (ball.normals * ball.vertices).sum(axis=1).min() > 0.99


def test_edges_of_a_profile_stay_sharp() -> None:
    can = lathe([(0, 0), (1, 0), (1, 1), (0, 1)])
    assert set(np.round(np.abs(can.normals[:, 2]), 3)) <= {0.0, 1.0}


def test_a_spline_goes_through_its_points() -> None:
    points = np.array([(0.0, 0.0), (1.0, 2.0), (3.0, 1.0)])
    curve = spline(points, 101)
    np.testing.assert_allclose(curve[[0, 50, 100]], points, atol=1e-12)
    np.testing.assert_allclose(spline(points, 3, closed=True), points, atol=1e-12)


def test_outlines_are_evenly_spaced() -> None:
    outline = rounded_rectangle(2, 1, 0.1, 200)
    assert np.ptp(outline, axis=0) == pytest.approx([2, 1], abs=0.02)
    gaps = np.linalg.norm(np.diff(evenly(outline, 50), axis=0), axis=1)
    assert gaps.max() < 1.1 * gaps.min()


def test_turns_are_the_rotations_but_the_identity() -> None:
    quarter, half, _ = turns(4)
    np.testing.assert_allclose(quarter @ quarter, half, atol=1e-12)
    np.testing.assert_allclose(quarter @ [1, 0, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(rotation_about("x", 90) @ [0, 1, 0], [0, 0, 1], atol=1e-12)


def test_a_unit_mesh_has_its_box_about_the_origin_with_a_diagonal_of_1() -> None:
    low, high = box((3, 4, 12)).moved((7, 7, 7)).unit().bounds
    np.testing.assert_allclose(low, -high)
    np.testing.assert_allclose(high - low, np.array([3, 4, 12]) / 13)

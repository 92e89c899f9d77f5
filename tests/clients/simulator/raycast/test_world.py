"""The rendered world: geometry is exact, and faults are those that were asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clients.simulator.raycast.model import Model
from clients.simulator.raycast.sensor import SensorConfig, _hidden
from clients.simulator.raycast.world import UP, RaycastWorld, standing
from core.camera_poses import look_at
from core.views import FloatArray, View

from ..conftest import BOX_M

ABOVE = look_at(np.array([0.001, 0.0, 0.6]), np.zeros(3), UP)
ASIDE = look_at(np.array([0.5, 0.1, 0.35]), np.array([0.0, 0.0, 0.05]), UP)


def world_with(brick: Model, sensor: SensorConfig, rotation: FloatArray | None = None) -> RaycastWorld:
    world = RaycastWorld(3, sensor)
    world.show([brick], [standing(brick, np.eye(3) if rotation is None else rotation, (0.0, 0.0))])
    return world


def depth(view: View) -> FloatArray:
    assert view.depth_m is not None
    return view.depth_m


def test_depth_is_that_of_the_box_and_of_the_table(brick: Model, small: SensorConfig) -> None:
    view = world_with(brick, small).capture_with_mask(ABOVE)
    assert view.mask is not None
    assert view.camera is not None
    np.testing.assert_allclose(depth(view)[60, 80], 0.5, atol=1e-4)
    np.testing.assert_allclose(depth(view)[5, 5], 0.6, atol=2e-3)
    rows, columns = np.nonzero(view.mask & (depth(view) > 0))
    points = view.camera.back_project(np.stack([columns, rows], axis=1).astype(float), depth(view)[rows, columns])
    np.testing.assert_allclose(np.abs(points[:, :2]).max(axis=0), BOX_M[:2] / 2, atol=0.006)


def test_colours_are_where_they_belong(brick: Model, small: SensorConfig) -> None:
    view = world_with(brick, small).capture_with_mask(ASIDE)
    assert view.mask is not None
    rows, columns = np.nonzero(view.mask)
    top, bottom = (
        view.rgb[rows[chosen], columns[chosen]].mean(axis=0) for chosen in (rows <= np.quantile(rows, 0.3), rows >= np.quantile(rows, 0.9))
    )
    assert top[0] > 1.5 * top[2]
    assert bottom[2] > 1.5 * bottom[0]


def test_a_thing_darkens_the_table_where_it_stands(brick: Model, small: SensorConfig) -> None:
    empty, full = (RaycastWorld(3, small) for _ in range(2))
    full.show([brick], [standing(brick, np.eye(3), (0.0, 0.0))])
    view = full.capture_with_mask(ASIDE)
    before = empty.capture(ASIDE)
    assert view.mask is not None
    lost = before.rgb.astype(float).sum(axis=2) - view.rgb.astype(float).sum(axis=2)
    assert lost[~view.mask].max() > 60
    assert np.quantile(lost[~view.mask], 0.05) > -15


def test_the_same_seed_gives_the_same_picture_and_another_another(brick: Model) -> None:
    views = []
    for seed in (5, 5, 6):
        world = RaycastWorld(seed, SensorConfig(size=(120, 160), focal_px=145.0))
        world.show([brick])
        views.append(world.capture(ASIDE))
    np.testing.assert_array_equal(views[0].rgb, views[1].rgb)
    np.testing.assert_array_equal(depth(views[0]), depth(views[1]))
    assert np.abs(views[0].rgb.astype(int) - views[2].rgb).mean() > 5


def test_range_noise_grows_with_the_square_of_the_distance(small: SensorConfig) -> None:
    world = RaycastWorld(0, replace(small, disparity_noise_px=0.1))
    spread = []
    for height in (0.4, 0.8):
        measured = depth(world.capture(look_at(np.array([0.001, 0, height]), np.zeros(3), UP)))[40:80, 50:110]
        spread.append(float((measured - height).std()))
    assert spread[1] / spread[0] == pytest.approx(4, rel=0.25)


def test_disparities_are_quantised(small: SensorConfig) -> None:
    config = replace(small, disparity_step_px=0.5)
    measured = depth(RaycastWorld(0, config).capture(ASIDE))
    disparity = config.focal_px * config.baseline_m / measured[measured > 0]
    np.testing.assert_allclose(disparity / 0.5, np.round(disparity / 0.5), atol=1e-3)


def test_near_things_throw_a_shadow_into_depth_on_their_left(brick: Model, small: SensorConfig) -> None:
    """What the right eye does not see lies to the left of what hides it."""
    view = world_with(brick, small).capture_with_mask(ABOVE)
    assert view.mask is not None
    columns = np.flatnonzero(view.mask[60])
    row = depth(view)[60]
    width = small.focal_px * small.baseline_m * (1 / 0.5 - 1 / 0.6)
    assert (row[columns[0] - 20 : columns[0]] == 0).sum() == pytest.approx(width, abs=1.5)
    assert (row[columns[-1] + 1 : columns[-1] + 21] > 0).all()


def test_a_place_is_in_the_shadow_of_what_is_nearer_by_more_disparity_than_pixels() -> None:
    disparity = np.full((1, 12), 2.0)
    disparity[0, 6:] = 5.0
    np.testing.assert_array_equal(np.flatnonzero(_hidden(disparity)[0]), [4, 5])  # at 3 the second eye just sees past the edge


def test_dropouts_are_as_many_as_asked_for(small: SensorConfig) -> None:
    above = depth(RaycastWorld(0, replace(small, speckle=0.1)).capture(ABOVE))
    assert (above == 0).mean() == pytest.approx(0.1, abs=0.03)


def test_a_calibration_error_shifts_the_picture_but_not_the_camera(brick: Model, small: SensorConfig) -> None:
    exact = world_with(brick, small).capture_with_mask(ASIDE)
    off = world_with(brick, replace(small, hand_eye_m=0.02)).capture_with_mask(ASIDE)
    assert off.camera is not None
    np.testing.assert_array_equal(off.camera.world_from_camera, ASIDE)
    assert exact.mask is not None
    assert off.mask is not None
    assert (exact.mask != off.mask).sum() > 50


def test_objects_stand_on_the_table_however_they_are_turned(brick: Model, small: SensorConfig) -> None:
    on_its_side = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    view = world_with(brick, small, on_its_side).capture(ABOVE)
    assert depth(view)[60, 80] == pytest.approx(0.6 - BOX_M[0], abs=1e-3)


def test_a_moved_object_is_seen_where_it_was_brought(brick: Model, small: SensorConfig) -> None:
    world = world_with(brick, small)
    motion = np.eye(4)
    motion[:3, 3] = (0.0, 0.2, 0.0)
    world.move(0, motion)
    pose = world.objects[0].world_from_model
    assert pose is not None
    np.testing.assert_allclose(pose.translation, [0, 0.2, 0.05])
    assert depth(world.capture(ABOVE))[60, 80] == pytest.approx(0.6, abs=1e-3)


def test_viewpoints_look_at_the_middle_from_above_the_table(small: SensorConfig) -> None:
    world = RaycastWorld(0, small)
    poses = np.stack(world.viewpoints(6, seed=1))
    assert (poses[:, 2, 3] > 0.1).all()
    towards = world.center_m - poses[:, :3, 3]
    np.testing.assert_allclose((towards * poses[:, :3, 2]).sum(axis=1), np.linalg.norm(towards, axis=1))
    assert not np.allclose(poses, np.stack(world.viewpoints(6, seed=2)))

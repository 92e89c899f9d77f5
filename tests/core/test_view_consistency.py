"""What a view shows far from where the others have the object goes; views of all sides of one object stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from core.encode import EncodedBurst, EncodedView
from core.reference import build_reference
from core.sim3 import Sim3
from core.view_consistency import consistent_only

from .conftest import PaintedObject, before_the_object, blind


def of_a_table(view: EncodedView) -> EncodedView:
    """The same view, with patches spread over a table 1 m wide: 2.5 times as wide as the object."""
    points = np.random.default_rng(1).uniform(-0.5, 0.5, view.points_m.shape) * (1, 1, 0.01)
    return replace(view, points_m=points.astype(np.float32))


def with_table(encoded: EncodedBurst, index: int) -> EncodedBurst:
    views = list(encoded.views)
    views[index] = of_a_table(views[index])
    return replace(encoded, views=tuple(views))


def test_of_a_view_of_the_table_what_lies_within_the_object_is_left_at_most(painted: PaintedObject) -> None:
    encoded = with_table(painted.encode(8), 2)
    kept = consistent_only(encoded)
    assert len(kept.views[2].cells) < 0.2 * len(encoded.views[2].cells)
    assert all(left is before for index, (left, before) in enumerate(zip(kept.views, encoded.views, strict=True)) if index != 2)
    np.testing.assert_allclose(build_reference(kept).box.extent_m, painted.reference(8).box.extent_m, rtol=0.1)


def test_of_a_view_that_shows_a_wall_too_the_object_stays(painted: PaintedObject) -> None:
    encoded = painted.encode(8)
    view = encoded.views[3]
    walled = view.points_m.copy()
    walled[: len(walled) // 4] += (0.0, 3.0, 0.0)
    views = (*encoded.views[:3], replace(view, points_m=walled), *encoded.views[4:])
    kept = consistent_only(replace(encoded, views=views)).views[3]
    np.testing.assert_array_equal(kept.points_m, view.points_m[len(walled) // 4 :])
    np.testing.assert_array_equal(kept.descriptors, view.descriptors[len(walled) // 4 :])


def test_all_sides_of_an_object_stay(painted: PaintedObject, moved: Sim3) -> None:
    encoded = painted.encode(12, moved)
    assert all(kept is view for kept, view in zip(consistent_only(encoded).views, encoded.views, strict=True))


def test_two_views_are_enough_to_contradict_a_third(painted: PaintedObject) -> None:
    encoded = painted.encode(3)
    first, view, last = encoded.views
    kept = consistent_only(replace(encoded, views=(first, before_the_object(view, 0.6), last))).views
    assert len(kept[1].cells) < 0.5 * len(view.cells)
    assert (kept[0], kept[2]) == (first, last)


def test_of_two_views_that_differ_both_stay(painted: PaintedObject) -> None:
    encoded = with_table(painted.encode(2), 0)
    assert consistent_only(encoded) is encoded


def test_views_without_depth_say_nothing(painted: PaintedObject) -> None:
    photographed = blind(painted.encode(6))
    assert consistent_only(photographed) is photographed


def test_what_is_before_the_object_in_one_view_goes(painted: PaintedObject) -> None:
    encoded = painted.encode(8)
    view = encoded.views[3]
    found = replace(encoded, views=(*encoded.views[:3], before_the_object(view, 0.6), *encoded.views[4:]))
    kept = consistent_only(found).views
    np.testing.assert_array_equal(kept[3].points_m, view.points_m[int(0.6 * len(view.cells)) :])
    assert all(left is before for index, (left, before) in enumerate(zip(kept, encoded.views, strict=True)) if index != 3)


def test_patches_without_depth_are_not_judged(painted: PaintedObject) -> None:
    encoded = painted.encode(8)
    points = encoded.views[3].points_m.copy()
    points[::2] = np.nan
    views = (*encoded.views[:3], replace(encoded.views[3], points_m=points), *encoded.views[4:])
    assert consistent_only(replace(encoded, views=views)).views[3] is views[3]


def test_cameras_that_are_all_wrong_take_nothing_out(painted: PaintedObject) -> None:
    encoded = painted.encode(6)

    def moved(view: EncodedView, index: int) -> EncodedView:
        assert view.camera is not None
        pose = view.camera.world_from_camera.copy()
        pose[:3, 3] += 10.0 * index
        return replace(view, camera=replace(view.camera, world_from_camera=pose), points_m=view.points_m + np.float32(10.0 * index))

    astray = replace(encoded, views=tuple(moved(view, index) for index, view in enumerate(encoded.views)))
    assert all(kept is view for kept, view in zip(consistent_only(astray).views, astray.views, strict=True))

"""Views that do not fit together are told apart from views that do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.camera_poses import hemisphere
from core.coherence import incoherent, require_one_place, require_one_unit
from core.encode import Encoder
from core.errors import InvalidInput
from core.sim3 import Sim3
from core.views import Burst, Camera

UP = np.array([0.0, 0.0, 1.0])


def at(x, y, z):
    """Where an object stands."""
    return Sim3(1.0, np.eye(3), np.array([x, y, z]))


def with_cameras(burst, change):
    """The same images and depth with world_from_camera changed."""
    return Burst([replace(each, camera=Camera(each.camera.K, change(each.camera.world_from_camera))) for each in burst.views])


def with_translations(burst, times):
    """From cameras whose translations are in another unit."""
    scaling = np.diag([times, times, times, 1.0])
    return with_cameras(burst, lambda pose: scaling @ pose @ np.linalg.inv(scaling))


def with_depth(burst, times):
    return Burst([replace(each, depth_m=each.depth_m * np.float32(times)) for each in burst.views])


@pytest.mark.parametrize("views", [2, 3, 8])
@pytest.mark.parametrize("place", [at(0, 0, 0), at(3, -2, 1)], ids=["origin", "far"])
def test_metres_throughout_are_one_unit(look, backbone, views, place):
    require_one_unit(Encoder(backbone).encode(look(views=views, world_from_object=place)))


@pytest.mark.parametrize(
    ("change", "times"), [*((with_translations, each) for each in (1000, 10, 0.1, 0.001)), (with_depth, 10), (with_depth, 0.1)]
)
def test_another_unit_of_cameras_or_of_depth_is_refused(look, backbone, change, times):
    with pytest.raises(InvalidInput, match=r"depth says .* world_from_camera says .* metres"):
        require_one_unit(Encoder(backbone).encode(change(look(), times)))


def test_views_from_one_side_do_not_tell(look, backbone):
    """Rays that are nearly parallel meet anywhere."""
    pose = hemisphere(np.zeros(3), UP, 0.5, 1)[0]
    beside = pose.copy()
    beside[:3, 3] += 0.005 * pose[:3, 0]
    require_one_unit(Encoder(backbone).encode(with_depth(look(poses=[pose, beside]), 5)))


def test_one_view_and_views_without_depth_do_not_tell(look, backbone):
    encoder = Encoder(backbone)
    require_one_unit(encoder.encode(look(views=1)))
    flat = Burst([replace(each, depth_m=None) for each in look(views=5).views])
    require_one_unit(encoder.encode(flat))
    assert incoherent(flat, encoder.encode(flat)) == ((),) * 5


def test_cameras_at_one_place_that_look_elsewhere_do_not_tell(look, backbone):
    burst = look(views=3)
    here = burst.views[0].camera.world_from_camera[:, 3:]
    require_one_unit(Encoder(backbone).encode(with_cameras(burst, lambda pose: np.hstack([pose[:, :3], here]))))


def test_a_view_of_something_elsewhere_is_named(look, backbone):
    mixed = Burst(look(views=4).views + look("dark", views=1, world_from_object=at(1, 0, 0)).views)
    encoded = Encoder(backbone).encode(mixed)
    *rest, odd = incoherent(mixed, encoded)
    assert rest == [()] * 4
    assert [(fault.kind, "1 m from where" in fault.detail) for fault in odd] == [("elsewhere", True)]
    require_one_unit(encoded)
    require_one_place(encoded)


def test_views_of_one_object_are_nowhere_else(look, backbone):
    burst = look(views=8)
    encoded = Encoder(backbone).encode(burst)
    assert incoherent(burst, encoded) == ((),) * 8
    require_one_place(encoded)


@pytest.mark.parametrize("change", [np.linalg.inv, lambda pose: pose @ np.diag([1.0, -1, -1, 1])], ids=["inverse", "OpenGL's axes"])
@pytest.mark.parametrize("views", [2, 3, 8])
def test_cameras_by_which_the_object_is_everywhere_are_refused(look, backbone, change, views):
    encoded = Encoder(backbone).encode(with_cameras(look(views=views, world_from_object=at(0.6, 0.3, 0)), change))
    with pytest.raises(InvalidInput, match=r"^views: each has the object in another place, .* not the inverse and not OpenGL's axes$"):
        require_one_place(encoded)


def test_an_object_that_moved_between_all_views_is_refused(look, backbone):
    views = [look(views=4, world_from_object=at(0.5 * index, 0, 0)).views[index] for index in range(4)]
    with pytest.raises(InvalidInput, match="where it did not move"):
        require_one_place(Encoder(backbone).encode(Burst(views)))


def test_depth_on_another_spot_of_the_object_in_each_view_does_not_tell(look, backbone):
    encoded = Encoder(backbone).encode(look(views=4))

    def spot(view, place):
        kept = np.arange(len(view.points_m)) == place * (len(view.points_m) - 1) // 3
        return replace(view, points_m=np.where(kept[:, None], view.points_m, np.nan))

    require_one_place(replace(encoded, views=tuple(spot(view, place) for place, view in enumerate(encoded.views))))


def test_the_same_image_again_is_named_whatever_its_camera(look, backbone):
    burst = look(views=4)
    stuck = Burst([*burst.views, burst.views[1], replace(burst.views[2], camera=burst.views[3].camera)])
    faults = incoherent(stuck, Encoder(backbone).encode(stuck))
    assert [[fault.kind for fault in view if fault.kind == "copy"] for view in faults] == [[], [], [], [], ["copy"], ["copy"]]
    assert "view 1" in faults[4][0].detail

"""A track from frames with known answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.sim3 import Sim3, rotation_angle_deg
from core.tracking import Track, TrackConfig, blend, missed, seen, with_symmetries
from core.views import FloatArray

CENTER = np.array([0.3, -0.2, 0.5])
CONFIG = TrackConfig()
NONE = np.empty((0, 3, 3))
HALF_TURN = Rotation.from_euler("z", 180, degrees=True).as_matrix()[None]


def turned(angle_deg: float, scale: float = 1.0, shift: Sequence[float] = (0, 0, 0)) -> Sim3:
    """About the vertical through the object's middle."""
    rotation = Rotation.from_euler("z", angle_deg, degrees=True).as_matrix()
    return Sim3(scale, rotation, CENTER + shift - scale * rotation @ CENTER)


def step(track: Track, poses: Sequence[Sim3], symmetries: FloatArray = NONE) -> Track:
    """The track a frame later."""
    return seen(track, poses, symmetries, center_m=CENTER, diameter_m=0.2, age_s=0.2, elapsed_s=0.1, config=CONFIG)


def test_the_first_pose_is_reported_as_it_is() -> None:
    track = step(Track(), [turned(20)])
    assert track.pose is not None
    assert np.allclose(track.pose.as_matrix(), turned(20).as_matrix())
    assert track.data_age_s == 0.2


def test_noise_is_smoothed_and_the_pose_does_not_drift() -> None:
    rng = np.random.default_rng(0)
    track, errors = Track(), []
    for _ in range(200):
        track = step(track, [turned(10 + rng.normal(scale=4))])
        assert track.pose is not None
        errors.append(float(rotation_angle_deg(track.pose.rotation, turned(10).rotation)))
    assert np.mean(errors[10:]) < 0.7 * 4 * np.sqrt(2 / np.pi)


def test_the_reported_age_is_the_lag_of_an_object_that_turns_steadily() -> None:
    track, frames, per_frame_deg = Track(), 60, 2.0
    config = replace(CONFIG, weight=0.25)
    for frame in range(frames):  # each estimate is of the moment itself
        track = seen(track, [turned(per_frame_deg * frame)], NONE, center_m=CENTER, diameter_m=0.2, age_s=0.0, elapsed_s=0.1, config=config)
    assert track.pose is not None
    behind_deg = float(rotation_angle_deg(track.pose.rotation, turned(per_frame_deg * (frames - 1)).rotation))
    assert behind_deg / per_frame_deg * 0.1 == pytest.approx(track.data_age_s, rel=0.01)


def test_a_symmetric_flip_is_not_reported() -> None:
    track = step(Track(), [turned(0)])
    for angle in (180, 3, 184, 176):
        track = step(track, [turned(angle)], HALF_TURN)
        assert track.pose is not None
        assert rotation_angle_deg(track.pose.rotation, np.eye(3)) < 5
        assert np.allclose(track.pose.apply(CENTER), CENTER)


def test_an_alternative_near_the_last_pose_is_preferred() -> None:
    track = step(step(Track(), [turned(0)]), [turned(120), turned(4)])
    assert track.pose is not None
    assert rotation_angle_deg(track.pose.rotation, np.eye(3)) == pytest.approx(2)


def test_a_single_jump_is_ignored_and_a_lasting_one_believed() -> None:
    track = step(step(Track(), [turned(0)]), [turned(100)])
    assert track.pose is not None
    assert np.allclose(track.pose.rotation, np.eye(3))
    assert track.data_age_s == pytest.approx(0.3)
    track = step(track, [turned(102)])
    assert track.pose is not None
    assert np.allclose(track.pose.rotation, np.eye(3))
    track = step(track, [turned(100)])
    assert track.pose is not None
    assert np.allclose(track.pose.rotation, turned(100).rotation)


def test_jumps_that_do_not_agree_are_never_believed() -> None:
    track = step(Track(), [turned(0)])
    for angle_deg in (100, 100, 200, 200, 100, 100):
        track = step(track, [turned(angle_deg)])
        assert track.pose is not None
        assert np.allclose(track.pose.rotation, np.eye(3))


@pytest.mark.parametrize(("scale", "jumps"), [(1.0, True), (2.0, False)])
def test_how_far_is_a_jump_grows_with_the_object(scale: float, jumps: bool) -> None:
    track = step(step(Track(), [turned(0, scale)]), [turned(0, scale, (0.15, 0, 0))])
    assert (track.jumped is not None) == jumps


def test_a_moved_object_is_a_jump_too() -> None:
    away = turned(0, shift=(0.5, 0, 0))
    track = step(step(Track(), [turned(0)]), [away])
    assert track.pose is not None
    assert np.allclose(track.pose.translation, 0)
    track = step(step(track, [away]), [away])
    assert track.pose is not None
    assert np.allclose(track.pose.translation, [0.5, 0, 0])


def test_a_moved_symmetric_object_is_believed_by_whichever_of_its_poses_is_found() -> None:
    track = step(Track(), [turned(0)])
    for angle in (10, 190, 10):
        track = step(track, [turned(angle, shift=(0.5, 0, 0))], HALF_TURN)
    assert track.pose is not None
    assert np.allclose(track.pose.as_matrix(), turned(10, shift=(0.5, 0, 0)).as_matrix())


def test_an_alternative_does_not_speak_for_a_jump() -> None:
    track = step(step(Track(), [turned(0)]), [turned(100)])
    for _ in range(CONFIG.believe_after):
        track = step(track, [turned(200), turned(100)])
    assert track.pose is not None
    assert np.allclose(track.pose.rotation, turned(200).rotation)


def test_an_object_is_lost_after_a_while_and_found_anew() -> None:
    track = step(Track(), [turned(0)])
    for _ in range(CONFIG.lose_after - 1):
        track = missed(track, 0.1, CONFIG)
        assert track.found
    assert track.data_age_s == pytest.approx(0.4)
    track = missed(track, 0.1, CONFIG)
    assert not track.found
    assert step(track, [turned(90)]).pose is not None


def test_a_pose_that_is_not_believed_yet_is_no_miss() -> None:
    track = step(Track(), [turned(0)])
    for poses in (None, None, [turned(100)], None, None):
        track = missed(track, 0.1, CONFIG) if poses is None else step(track, poses)
    assert track.found


def test_symmetries_turn_the_reference_about_its_middle() -> None:
    pose = turned(30, 1.5, (0.1, 0, 0))
    same, other = with_symmetries([pose], HALF_TURN, CENTER)
    assert same is pose
    assert np.allclose(other.as_matrix(), turned(210, 1.5, (0.1, 0, 0)).as_matrix())
    assert with_symmetries([pose], NONE, CENTER) == [pose]


def test_a_blend_goes_as_far_in_every_part() -> None:
    quarter = blend(turned(10, 2.0), turned(50, 32.0, (0.2, 0, 0)), CENTER, 0.25)
    assert np.allclose(quarter.as_matrix(), turned(20, 4.0, (0.05, 0, 0)).as_matrix())

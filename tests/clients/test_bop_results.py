"""Poses as lines of the BOP benchmark's results."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clients.answers.observations import Pose
from clients.bop_results import HEADER, bop_lines, number_of
from core.sim3 import Sim3
from core.views import Camera

K = np.array([[50.0, 0, 20], [0, 50, 16], [0, 0, 1]])


def test_each_image_has_a_line_in_the_published_order() -> None:
    """The object is 2 m before the first camera; the second one, a quarter turn about x away, has it 2 m above its axis."""
    world_from_object, turned = np.eye(4), np.eye(4)
    world_from_object[:3, 3] = [0.1, 0.0, 2.0]
    turned[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    pose = Pose(Sim3.identity(), world_from_object, np.ones(3), np.zeros((8, 3)), 9, 10, 0, 0.01, 0.5, None, (), np.zeros((0, 4)))
    lines = bop_lines(pose, [Camera(K, np.eye(4)), Camera(K, turned)], [Path("000012.jpg"), Path("left.png")], 7, 5, 1.25)
    assert HEADER == "scene_id,im_id,obj_id,score,R,t,time"
    assert lines[0] == "7,12,5,0.5,1 0 0 0 1 0 0 0 1,100 0 2000,1.25"
    scene, image, number, score, rotation, translation, seconds = lines[1].split(",")
    assert (scene, image, number, score, seconds) == ("7", "1", "5", "0.5", "1.25")
    np.testing.assert_allclose(np.array(rotation.split(), float).reshape(3, 3), turned[:3, :3].T, atol=1e-9)
    np.testing.assert_allclose(np.array(translation.split(), float), 1000 * turned[:3, :3].T @ [0.1, 0, 2], atol=1e-6)


def test_only_plain_digits_are_a_number() -> None:
    assert [number_of(name, 3) for name in ("000007", "7a", "", None, "²")] == [7, 3, 3, 3, 3]

"""The history of observations and the pictures behind it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.service.conftest import picture


@pytest.fixture
def seen(client, look, parts, ball):
    """An observation of a known object."""
    return client.post("/v1/observations", files=parts(look("bright", views=4))).json()


def test_an_observation_is_answered_again(client, seen):
    assert client.get(f"/v1/observations/{seen['id']}").json() == seen


def test_the_latest_comes_first(client, seen):
    latest, _ = client.get("/v1/observations").json()["observations"]
    assert latest == seen


def test_no_more_are_listed_than_asked_for(client, seen):
    assert client.get("/v1/observations?limit=1").json()["observations"] == [seen]


def test_timings_name_every_stage_within_the_total(seen):
    timings = dict(seen["timings_ms"])
    total = timings.pop("total")
    assert {"find", "features", "points", "decide", "load", "match", "views", "solve"} <= set(timings)
    assert 0 < sum(timings.values()) <= total * 1.001


def test_the_frame_s_name_comes_back(client, look, parts):
    answer = client.post("/v1/observations", files=parts(look(), lambda about, files: about.update(frame="table")))
    assert answer.json()["frame"] == "table"


def test_debug_is_there_only_when_asked_for(client, seen):
    assert seen["debug"] is None
    debug = client.get(f"/v1/observations/{seen['id']}?include=debug").json()["debug"]
    assert np.array(debug["view_similarity"]).shape == (6, 4)
    assert all(0 <= reference < 6 and 0 <= target < 4 for reference, target in debug["pairs"])


def test_a_named_category_skips_the_decision(client, look, parts, ball):
    answer = client.post("/v1/observations", files=parts(look("dark")), params={"category_id": ball["id"]}).json()
    assert (answer["outcome"], answer["category_id"]) == ("known", ball["id"])
    assert (answer["score"], answer["threshold"], answer["similarities"]) == (None, None, [])


def test_a_higher_threshold_makes_it_novel(client, look, parts, ball):
    answer = client.post("/v1/observations", files=parts(look()), params={"threshold": 9}).json()
    assert (answer["outcome"], answer["threshold"]) == ("novel", 9)


def test_only_the_first_views_are_used(client, look, parts):
    answer = client.post("/v1/observations", files=parts(look()), params={"views_used": 2}).json()
    assert answer["views"] == 2


def test_a_known_object_joins_its_category(client, look, parts, ball):
    seen = client.post("/v1/observations", files=parts(look(views=3))).json()
    assert client.get(f"/v1/categories/{ball['id']}").json()["instances"] == 2
    joined = client.app.state.running.agent.memory.instances.members()[-1]
    assert (joined.category_id, len(joined.cls)) == (seen["category_id"], 3)


def test_without_learning_what_is_known_stays_as_it_is(client, look, parts, ball):
    asked = {"files": parts(look(views=3)), "params": {"learn": False}}
    first, again = (client.post("/v1/observations", **asked).json() for _ in range(2))
    assert first["outcome"] == again["outcome"] == "known"
    assert first["similarities"] == again["similarities"]
    assert client.get("/v1/categories").json() == {"categories": [ball]}


def test_a_novel_object_joins_nothing(client, look, parts, ball):
    assert client.post("/v1/observations", files=parts(look("dark"))).json()["outcome"] == "novel"
    assert client.get("/v1/categories").json() == {"categories": [ball]}


def test_a_view_comes_back_as_it_was_sent(client, look, seen):
    assert np.array_equal(picture(client.get(f"/v1/observations/{seen['id']}/rgb.png?view=3")), look("bright", views=4).views[3].rgb)


def test_the_overlay_draws_a_box_around_the_object(client, look, seen):
    view = look("bright", views=4).views[1]
    shown = picture(client.get(f"/v1/observations/{seen['id']}/overlay.png?view=1")).astype(int)
    assert shown.shape == view.rgb.shape
    drawn = (np.abs(shown - [255, 200, 0]) < 60).all(axis=2) & ~(view.depth_m > 0)
    rows, columns = np.nonzero(drawn)
    object_rows, object_columns = np.nonzero(view.depth_m > 0)
    assert drawn.sum() > 50
    assert abs(rows.mean() - object_rows.mean()) < 15
    assert abs(columns.mean() - object_columns.mean()) < 15


def test_correspondences_join_two_crops(client, seen):
    shown = picture(client.get(f"/v1/observations/{seen['id']}/correspondences.png")).astype(int)
    assert shown.shape == (448, 2 * 448 + 16, 3)
    gap = shown[:, 448:464]
    assert (gap.min(axis=2) < 200).any()


def test_the_best_view_is_where_most_correspondences_agree(client, seen):
    arrays = client.app.state.running.agent.memory.observations.features(seen["id"])
    inliers = np.bincount(arrays["match_target_view"][arrays["match_inlier"]], minlength=4)
    assert inliers[seen["pose"]["best_view"]] == inliers.max()
    path = f"/v1/observations/{seen['id']}/correspondences.png"
    named = picture(client.get(path, params={"view": seen["pose"]["best_view"]}))
    assert np.array_equal(picture(client.get(path)), named)


def test_correspondences_of_a_view_that_the_pose_does_not_rest_on(client, seen):
    answer = client.get(f"/v1/observations/{seen['id']}/correspondences.png?view=99")
    assert answer.status_code == 404
    assert "rests on the views" in answer.json()["detail"]


def test_foreground_and_components_of_a_view(client, seen):
    for name in ("foreground", "pca"):
        assert picture(client.get(f"/v1/observations/{seen['id']}/{name}.png?view=2")).shape == (448, 448, 3)


def test_a_novel_object_has_components_before_and_after_its_scan(client, look, parts):
    novel = client.post("/v1/observations", files=parts(look())).json()
    path = f"/v1/observations/{novel['id']}/pca.png"
    own = picture(client.get(path))
    client.post(f"/v1/scans/{novel['scan']['id']}/views", files=parts(look()))
    client.post(f"/v1/scans/{novel['scan']['id']}/complete")
    assert picture(client.get(path)).shape == own.shape


@pytest.mark.parametrize("name", ["overlay", "correspondences"])
def test_without_a_pose_there_is_nothing_to_draw(client, look, parts, name):
    novel = client.post("/v1/observations", files=parts(look())).json()
    answer = client.get(f"/v1/observations/{novel['id']}/{name}.png")
    assert answer.status_code == 404
    assert "pose" in answer.json()["detail"]


def test_a_deleted_category_leaves_the_history(client, seen):
    client.delete(f"/v1/categories/{seen['category_id']}")
    now = client.get(f"/v1/observations/{seen['id']}").json()
    assert (now["outcome"], now["category_id"], now["name"]) == ("known", None, None)
    assert client.get(f"/v1/observations/{seen['id']}/correspondences.png").status_code == 404
    assert client.get(f"/v1/observations/{seen['id']}/overlay.png").status_code == 200


@pytest.mark.parametrize("path", ["", "/rgb.png", "/pca.png", "/foreground.png", "/overlay.png", "/correspondences.png"])
def test_an_unknown_observation(client, path):
    answer = client.get(f"/v1/observations/nope{path}")
    assert answer.status_code == 404
    assert "no observation has the id 'nope'" in answer.json()["detail"]


def test_a_view_it_does_not_have(client, seen):
    for name in ("rgb", "pca", "foreground", "overlay"):
        answer = client.get(f"/v1/observations/{seen['id']}/{name}.png?view=4")
        assert answer.status_code == 404
        assert "views 0 to 3" in answer.json()["detail"]


def test_one_view_is_answered_and_says_how_little_that_is(client, look, parts, seen):
    one = client.post("/v1/observations", files=parts(look().select([2])), params={"learn": False}).json()["grounds"]
    assert (one["views"], one["shown"], one["with_depth"]) == (1, 1, 1)
    assert "one view" in one["weakness"]
    assert seen["grounds"]["weakness"] is None
    assert seen["grounds"]["spread_deg"] > 60


def test_a_view_s_box_is_around_the_object(look, seen):
    for box, view in zip(seen["pose"]["boxes_px"], look("bright", views=4).views, strict=True):
        rows, columns = np.nonzero(view.depth_m > 0)
        left, top, right, bottom = box
        middle_x, middle_y = columns.mean(), rows.mean()
        assert left < middle_x < right
        assert top < middle_y < bottom
        assert right - left < 2 * np.ptp(columns)
        assert bottom - top < 2 * np.ptp(rows)


def test_no_more_alternatives_than_asked(client, look, parts, seen):
    options = {"category_id": seen["category_id"], "variant": "best", "learn": False}
    counts = [
        len(client.post("/v1/observations", files=parts(look()), params=options | {"alternatives": count}).json()["pose"]["alternatives"])
        for count in (0, 1)
    ]
    assert counts[0] == 0
    assert counts[1] <= 1


def test_nine_dimensions_are_answered_where_asked_for(client, look, parts, seen):
    options = {"category_id": seen["category_id"], "learn": False}
    answer = client.post("/v1/observations", files=parts(look()), params=options | {"dof": 9})
    assert answer.status_code == 201, answer.text
    nine = answer.json()["pose"]
    assert nine["not_9d_because"] is None
    assert np.allclose(nine["target_from_object"]["scales"], 1, atol=0.1)
    assert seen["pose"]["target_from_object"] is None


@pytest.mark.parametrize(("name", "value"), [("dof", 8), ("method", "guess"), ("estimator", "guess"), ("dims", 0), ("alternatives", -1)])
def test_a_wrong_option_is_told(client, look, parts, name, value):
    answer = client.post("/v1/observations", files=parts(look()), params={name: value})
    assert (answer.status_code, answer.json()["field"]) == (422, name)


def test_the_history_is_paged_and_filtered(client, look, parts, seen):
    older = client.post("/v1/observations", files=parts(look("dark"))).json()
    newest = client.post("/v1/observations", files=parts(look("dark"))).json()

    def ids(**options):
        return [each["id"] for each in client.get("/v1/observations", params=options).json()["observations"]]

    assert ids(limit=1) == [newest["id"]]
    assert ids(limit=1, before=newest["id"]) == [older["id"]]
    assert ids(category_id=seen["category_id"]) == [seen["id"]]
    assert ids(outcome="known") == [seen["id"]]
    assert client.get("/v1/observations", params={"before": "nope"}).status_code == 404


def test_a_known_object_in_the_shape_of_vision_msgs(client, seen):
    array = client.get(f"/v1/observations/{seen['id']}", params={"format": "vision_msgs"}).json()
    assert set(array) == {"header", "detections"}
    assert set(array["header"]) == {"stamp", "frame_id"}
    assert set(array["header"]["stamp"]) == {"sec", "nanosec"}
    (detection,) = array["detections"]
    assert set(detection) == {"header", "results", "bbox", "id"}
    (result,) = detection["results"]
    assert set(result) == {"hypothesis", "pose"}
    assert set(result["hypothesis"]) == {"class_id", "score"}
    assert result["hypothesis"]["class_id"] == seen["category_id"]
    assert set(result["pose"]) == {"pose", "covariance"}
    assert len(result["pose"]["covariance"]) == 36
    assert set(detection["bbox"]) == {"center", "size"}
    placed = np.array(seen["pose"]["world_from_object"])
    position, orientation = (result["pose"]["pose"][name] for name in ("position", "orientation"))
    assert [position[axis] for axis in "xyz"] == pytest.approx(placed[:3, 3])
    assert np.allclose(Rotation.from_quat([orientation[axis] for axis in "xyzw"]).as_matrix(), placed[:3, :3])
    assert [detection["bbox"]["size"][axis] for axis in "xyz"] == pytest.approx(seen["pose"]["box"]["extent_m"])


def test_a_novel_object_is_no_detection(client, look, parts):
    array = client.post("/v1/observations", files=parts(look()), params={"format": "vision_msgs"}).json()
    assert array["detections"] == []


@pytest.mark.parametrize("moment", ["reference", "create"])
def test_what_is_deleted_while_it_is_decided_for_is_decided_anew(client, look, parts, ball, monkeypatch, moment):
    """Before its reference is read, or after, before the answer is kept."""
    memory = client.app.state.running.agent.memory
    place = memory.categories if moment == "reference" else memory.observations
    kept = getattr(place, moment)

    def deleted_first(*args, **options):
        if memory.categories.all():
            memory.categories.delete(ball["id"])
        return kept(*args, **options)

    monkeypatch.setattr(place, moment, deleted_first)
    answer = client.post("/v1/observations", files=parts(look()))
    assert (answer.status_code, answer.json()["outcome"]) == (201, "novel")
    assert len(client.get("/v1/observations").json()["observations"]) == 2  # that of learning, and this one


def test_a_category_that_the_caller_names_is_not_decided_anew(client, look, parts, ball, monkeypatch):
    memory = client.app.state.running.agent.memory
    kept = memory.categories.reference

    def deleted_first(category_id):
        memory.categories.delete(category_id)
        return kept(category_id)

    monkeypatch.setattr(memory.categories, "reference", deleted_first)
    answer = client.post("/v1/observations", files=parts(look()), params={"category_id": ball["id"]})
    assert answer.status_code == 404

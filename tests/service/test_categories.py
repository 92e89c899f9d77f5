"""Categories over HTTP: listed, named, forgotten, and shown."""

from __future__ import annotations

import numpy as np
import pytest

from tests.service.conftest import colour_only, picture


def test_categories_are_listed_oldest_first(client, learn):
    made = [learn("bright", "first"), learn("dark", "second")]
    assert client.get("/v1/categories").json() == {"categories": made}
    assert client.get(f"/v1/categories/{made[1]['id']}").json() == made[1]


def test_a_category_is_named_and_unnamed(client, learn):
    path = f"/v1/categories/{learn()['id']}"
    assert client.patch(path, json={"name": "ball"}).json()["name"] == "ball"
    assert client.patch(path, json={"name": None}).json()["name"] is None


def test_a_forgotten_category_is_novel_again(client, look, parts, learn):
    path = f"/v1/categories/{learn()['id']}"
    assert client.delete(path).status_code == 204
    assert client.get(path).status_code == 404
    assert client.post("/v1/observations", files=parts(look())).json()["outcome"] == "novel"


def test_its_extent_is_about_the_object_s(learn):
    extent = np.sort(learn()["extent_m"])
    assert np.all(extent < np.sort([0.1, 0.14, 0.2]) * 1.1)
    assert extent[2] > 0.17


def test_a_view_comes_back_as_it_was_sent(client, look, ball):
    shown = picture(client.get(f"/v1/categories/{ball['id']}/views/2/rgb.png"))
    assert np.array_equal(shown, look().views[2].rgb)


def test_missing_depth_is_filled_in_at_half_brightness(client, look, learn):
    shown = picture(client.get(f"/v1/categories/{learn()['id']}/views/1/depth.png"))
    measured = look().views[1].depth_m > 0
    assert shown.any(axis=2).all()
    assert shown[~measured].max() < 128 < shown[measured].max()


def test_the_foreground_is_brighter_than_the_rest(client, learn):
    shown = picture(client.get(f"/v1/categories/{learn()['id']}/views/0/foreground.png"))
    assert shown.shape == (448, 448, 3)
    assert shown[224, 224].max() > 60
    assert shown[2, 2].max() < 20


def test_the_mask_is_where_the_object_is(client, look, learn):
    shown = picture(client.get(f"/v1/categories/{learn()['id']}/views/0/mask.png"))[..., 0] > 128
    on_object = look().views[0].depth_m > 0
    assert (shown & on_object).sum() / (shown | on_object).sum() > 0.85


def test_the_object_is_more_salient_than_the_rest(client, learn):
    shown = picture(client.get(f"/v1/categories/{learn()['id']}/views/0/saliency.png")).astype(int)
    assert shown.shape == (448, 448, 3)
    assert shown[224, 224].sum() > 2 * shown[2, 2].sum()


def test_components_colour_the_object_only(client, learn):
    shown = picture(client.get(f"/v1/categories/{learn()['id']}/views/0/pca.png")).astype(int)
    saturation = shown.max(axis=2) - shown.min(axis=2)
    assert saturation[2, 2] == 0
    assert saturation[150:300, 150:300].mean() > 40


def test_its_box_is_drawn_around_the_object(client, look, learn):
    view = look().views[1]
    shown = picture(client.get(f"/v1/categories/{learn()['id']}/views/1/overlay.png")).astype(int)
    drawn = (np.abs(shown - [255, 200, 0]) < 60).all(axis=2) & ~(view.depth_m > 0)
    assert drawn.sum() > 50
    assert np.allclose(np.argwhere(drawn).mean(axis=0), np.argwhere(view.depth_m > 0).mean(axis=0), atol=15)


def test_the_cloud_is_a_ply_file_with_its_points_on_the_object(client, learn, tmp_path):
    import open3d as o3d

    answer = client.get(f"/v1/categories/{learn()['id']}/cloud.ply")
    path = tmp_path / "cloud.ply"
    path.write_bytes(answer.content)
    points = np.asarray(o3d.io.read_point_cloud(str(path)).points)
    on_surface = ((points / [0.10, 0.07, 0.05]) ** 2).sum(axis=1)
    assert len(points) > 500
    assert np.allclose(np.median(on_surface), 1, atol=0.02)


@pytest.mark.parametrize(
    "path",
    [
        "/views/6/rgb.png",
        "/views/6/pca.png",
        "/views/6/foreground.png",
        "/views/6/depth.png",
        "/views/6/overlay.png",
        "/views/6/mask.png",
        "/views/6/saliency.png",
    ],
)
def test_a_view_it_does_not_have(client, learn, path):
    answer = client.get(f"/v1/categories/{learn()['id']}{path}")
    assert answer.status_code == 404
    assert "views 0 to 5" in answer.json()["detail"]


@pytest.mark.parametrize("path", ["", "/cloud.ply", "/views/0/rgb.png", "/views/0/pca.png"])
def test_an_unknown_category(client, path):
    answer = client.get(f"/v1/categories/nope{path}")
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")
    assert "no category has the id 'nope'" in answer.json()["detail"]


def test_a_view_is_a_number(client, learn):
    answer = client.get(f"/v1/categories/{learn()['id']}/views/first/rgb.png")
    assert (answer.status_code, answer.json()["field"]) == (422, "view")


def test_its_instances_say_where_they_came_from(client, look, parts, ball):
    seen = client.post("/v1/observations", files=parts(look(views=4))).json()
    client.post("/v1/observations", files=parts(look(views=3)), params={"learn": False})
    client.post("/v1/observations", files=parts(look("dark", views=3)), params={"category_id": ball["id"]})
    instances = client.get(f"/v1/categories/{ball['id']}/instances").json()["instances"]
    assert [(each["how"], each["views"], each["kept"]) for each in instances] == [
        ("scan", 6, True),
        ("decision", 4, True),
        ("named", 3, True),
    ]
    assert instances[1]["source_id"] == seen["id"]
    assert instances[1]["similarity"] == pytest.approx(seen["similarities"][0]["similarity"])


def test_a_burst_recognised_wrongly_is_taken_out_again(client, look, parts, ball):
    client.post("/v1/observations", files=parts(look("dark")), params={"category_id": ball["id"]})
    path = f"/v1/categories/{ball['id']}/instances"
    wrong = client.get(path).json()["instances"][-1]
    assert client.delete(f"{path}/{wrong['id']}").status_code == 204
    assert client.get(f"/v1/categories/{ball['id']}").json()["instances"] == 1
    assert client.delete(f"{path}/{wrong['id']}").status_code == 404
    assert client.post("/v1/observations", files=parts(look("dark"))).json()["outcome"] == "novel"


def test_the_last_burst_stays(client, ball):
    path = f"/v1/categories/{ball['id']}/instances"
    (only,) = client.get(path).json()["instances"]
    assert client.delete(f"{path}/{only['id']}").status_code == 409


def test_merging_moves_the_bursts_and_ends_the_other(client, look, parts, learn):
    kept, other = learn("bright", "ball"), learn("dark", "stone")
    merged = client.post(f"/v1/categories/{kept['id']}/merge", json={"from": other["id"]})
    assert (merged.status_code, merged.json()["name"], merged.json()["instances"]) == (200, "ball", 2)
    assert client.get(f"/v1/categories/{other['id']}").status_code == 404
    assert client.post("/v1/observations", files=parts(look("dark"))).json()["category_id"] == kept["id"]


@pytest.mark.parametrize(("source", "status"), [("itself", 422), ("nope", 404)])
def test_what_cannot_be_merged(client, ball, source, status):
    body = {"from": ball["id"] if source == "itself" else source}
    assert client.post(f"/v1/categories/{ball['id']}/merge", json=body).status_code == status


def test_splitting_undoes_a_wrong_assignment(client, look, parts, ball):
    client.post("/v1/observations", files=parts(look("dark")), params={"category_id": ball["id"]})
    instances = client.get(f"/v1/categories/{ball['id']}/instances").json()["instances"]
    split = client.post(f"/v1/categories/{ball['id']}/split", json={"instance_ids": [instances[1]["id"]], "name": "stone"})
    assert split.status_code == 201, split.text
    assert (split.json()["name"], split.json()["instances"], split.json()["views"]) == ("stone", 1, 6)
    seen = client.post("/v1/observations", files=parts(look("dark"))).json()
    assert (seen["category_id"], seen["pose"] is not None) == (split.json()["id"], True)
    assert client.post("/v1/observations", files=parts(look())).json()["category_id"] == ball["id"]


def test_what_cannot_be_split(client, look, parts, ball):
    path = f"/v1/categories/{ball['id']}/split"
    (first,) = client.get(f"/v1/categories/{ball['id']}/instances").json()["instances"]
    whole = client.post(path, json={"instance_ids": [first["id"]]})
    assert (whole.status_code, whole.json()["field"]) == (422, "instance_ids")
    unknown = client.post(path, json={"instance_ids": ["nope"]})
    assert (unknown.status_code, unknown.json()["field"]) == (422, "instance_ids[0]")

    client.post("/v1/observations", files=parts(look(), colour_only), params={"category_id": ball["id"]})
    photographs = client.get(f"/v1/categories/{ball['id']}/instances").json()["instances"][1]
    refused = client.post(path, json={"instance_ids": [photographs["id"]]})
    assert (refused.status_code, "scan the object" in refused.json()["detail"]) == (409, True)


def test_similarity_tells_what_to_merge_and_what_to_split(client, look, parts, learn):
    bright, dark = learn("bright", "ball"), learn("dark", "stone")
    client.post("/v1/observations", files=parts(look(views=4)))
    found = client.get(f"/v1/categories/{bright['id']}/similarity").json()
    matrix = np.array(found["matrix"])
    assert matrix.shape == (2, 2)
    assert np.allclose(matrix, matrix.T)
    assert np.allclose(np.diag(matrix), 1, atol=1e-5)
    (other,) = found["categories"]
    assert (other["category_id"], other["name"]) == (dark["id"], "stone")
    assert other["similarity"] < found["threshold"] < matrix[0, 1]

"""Categories over HTTP: listed, named, forgotten, and shown."""

from __future__ import annotations

import cv2
import numpy as np
import pytest


def picture(answer):
    """The image of an answer, shape (H, W, 3), BGR."""
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png"), answer.text
    return cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)


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


def test_a_view_comes_back_as_it_was_sent(client, look, learn):
    category = learn()
    shown = picture(client.get(f"/v1/categories/{category['id']}/views/2/rgb.png"))
    assert np.array_equal(shown[..., ::-1], look().views[2].rgb)


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


def test_components_colour_the_object_only(client, learn):
    shown = picture(client.get(f"/v1/categories/{learn()['id']}/views/0/pca.png")).astype(int)
    saturation = shown.max(axis=2) - shown.min(axis=2)
    assert saturation[2, 2] == 0
    assert saturation[150:300, 150:300].mean() > 40


def test_its_box_is_drawn_around_the_object(client, look, learn):
    view = look().views[1]
    shown = picture(client.get(f"/v1/categories/{learn()['id']}/views/1/overlay.png")).astype(int)[..., ::-1]
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
    "path", ["/views/6/rgb.png", "/views/6/pca.png", "/views/6/foreground.png", "/views/6/depth.png", "/views/6/overlay.png"]
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

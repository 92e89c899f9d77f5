"""The page of the memory as a whole."""

from __future__ import annotations

import re

import numpy as np
import pytest
from fastapi.testclient import TestClient

from core.calibration import Calibration, Prior
from core.novelty import Decision, Member
from service.app import create_app
from service.console.score_chart import BASE, TICKS, WIDTH, score_chart
from service.console.token_map import HEIGHT, LABEL_HEIGHT, LABEL_WIDTH, ROOM, token_map
from service.console.token_map import WIDTH as MAP_WIDTH
from service.upkeep import Distribution


@pytest.fixture
def settings(settings):
    """The score that thresholds are made for."""
    return settings.model_copy(update={"score": "best"})


def test_an_empty_memory_has_a_page(client):
    text = client.get("/memory").text
    assert "Nothing was changed yet" in text
    assert "nothing to draw" in client.get("/memory/map").text


def test_it_tells_how_much_there_is_and_how_it_decides(client, learn):
    learn("bright", "cup")
    text = client.get("/memory").text
    info = client.get("/v1/memory").json()
    assert f"Version {info['version']}, made with colour" in text
    assert info["fingerprint"] in text
    thresholds = re.findall(r"known above <b>([0-9.]+)</b>", text)
    expected = [Calibration.fit([], Prior.shipped().of(verified)).threshold(0.01) for verified in (True, False)]
    assert [float(each) for each in thresholds] == pytest.approx(expected, abs=1e-3)


def test_a_rate_is_set_and_taken_back(client):
    assert "Set the false-known rate to 5 %" in client.post("/memory/calibrate", data={"percent": "5"}).text
    assert client.get("/v1/memory").json()["false_known_rate"] == 0.05
    client.post("/memory/calibrate", data={"percent": ""})
    assert client.get("/v1/memory").json()["false_known_rate"] == 0.01
    assert [client.post("/memory/calibrate", data={"percent": percent}).status_code for percent in ("80", "0.005")] == [422, 422]
    assert 'min="0.01" max="50"' in client.get("/memory").text


def test_a_threshold_that_is_set_has_no_chart(settings, backbone):
    with TestClient(create_app(settings.model_copy(update={"threshold": 0.5}), backbone=backbone)) as client:
        text = client.get("/memory").text
    assert "ONELOOK_THRESHOLD" in text
    assert 'class="scores"' not in text


def test_a_backup_says_where_it_is(client, learn, settings):
    learn("bright", "cup")
    page = client.post("/memory/backup")
    (folder,) = settings.backups.iterdir()
    assert f"Backed up the memory to {folder}" in page.text


def test_chosen_categories_are_exported_and_come_back(client, learn, look, parts):
    cup = learn("bright", "cup")["id"]
    scan = client.post("/v1/scans", files=parts(look("dark"))).json()["id"]
    client.post(f"/v1/scans/{scan}/views", files=parts(look("dark")))
    mug = client.post(f"/v1/scans/{scan}/complete", json={"name": "mug"}).json()["id"]
    answer = client.post("/memory/export", data={"category": [cup]})
    assert answer.headers["content-type"] == "application/zip"
    client.delete(f"/v1/categories/{cup}")
    entry = client.post("/v1/memory/import", content=answer.content, headers={"Content-Type": "application/zip"}).json()["entry_id"]
    assert "Imported 1 category" in client.get("/memory", params={"change": entry}).text
    names = [each["name"] for each in client.get("/v1/categories").json()["categories"]]
    assert sorted(names) == ["cup", "mug"]
    both = client.post("/memory/export").content
    assert mug.encode() in both


def test_changes_go_on_page_by_page(client, learn):
    cup = learn("bright", "cup")["id"]
    for index in range(25):
        client.patch(f"/v1/categories/{cup}", json={"name": f"name {index}"})
    text = client.get("/memory").text
    assert "“name 24”" in text
    assert "“name 3”" not in text
    older = re.search(r'hx-get="([^"]+before[^"]+)"', text)[1]
    part = client.get(older, headers={"HX-Request": "true"}).text
    assert "<html" not in part
    assert "Renamed “name 3” to “name 4”" in part
    assert "Learnt “cup” from 6 views" in part
    assert client.get("/memory", params={"before": "none"}).status_code == 404


def test_names_are_text_and_never_markup(client, learn):
    learn("bright", "<img src=x onerror=alert(1)>")
    for path in ("/memory", "/memory/map"):
        text = client.get(path).text
        assert "<img src=x" not in text
        assert "&lt;img src=x" in text


def test_of_a_form_with_too_much_in_it_that_is_told(client):
    answer = client.post("/memory/export", data={"category": ["x"] * 1001})
    assert (answer.status_code, answer.json()["field"]) == (422, "body")
    assert "no form that can be read: Too many fields" in answer.json()["detail"]


def test_what_lies_right_of_the_threshold_is_known():
    prior = Prior.shipped().of(True)
    fit = Calibration.fit([0.2, 0.3], prior)
    decisions = tuple(
        Decision(outcome, "best", 0.4, (("a", value),), verified=True) for outcome, value in (("known", 0.9), ("novel", -0.2))
    )
    chart = score_chart(Distribution(fit, fit.levels(0.01), (0.2, 0.3), decisions))
    known, novel = chart.dots
    assert novel.x < chart.uncertain.x < chart.known.x < known.x
    assert chart.own_rivals == 2
    assert 2 <= len(chart.ticks) <= TICKS + 1
    places = np.array([[float(each) for each in pair.split(",")] for pair in re.findall(r"[-\d.]+,[-\d.]+", chart.rivals)])
    assert places[:, 0].min() >= 0
    assert places[:, 0].max() <= WIDTH
    top = places[places[:, 1].argmin()]
    assert top[0] == pytest.approx(np.interp(fit.location, [tick.value for tick in chart.ticks], [tick.x for tick in chart.ticks]), abs=3)
    assert places[:, 1].max() == BASE


def test_alike_bursts_are_near_each_other_in_the_map():
    rng = np.random.default_rng(0)
    middles = rng.normal(size=(3, 16))
    members = [Member(f"c{index % 3}", np.zeros((2, 16)), middles[index % 3] + 0.05 * rng.normal(size=(2, 16))) for index in range(30)]
    shown = token_map(members, {f"c{index}": None for index in range(3)})
    places = {each: np.array([[p.x, p.y] for p in shown.points if p.category_id == each]) for each in ("c0", "c1", "c2")}
    spread = max(np.linalg.norm(own - own.mean(axis=0), axis=1).max() for own in places.values())
    centres = [own.mean(axis=0) for own in places.values()]
    apart = min(np.linalg.norm(centres[a] - centres[b]) for a, b in ((0, 1), (0, 2), (1, 2)))
    assert apart > 4 * spread
    assert all(0 <= p.x <= MAP_WIDTH and 0 <= p.y <= HEIGHT for p in shown.points)
    reach = np.ptp(np.concatenate(list(places.values())), axis=0)
    assert np.isclose(reach, (MAP_WIDTH - 2 * ROOM, HEIGHT - 2 * ROOM), atol=0.2).any(), "as large as the drawing allows"
    assert len(shown.labels) == 3
    assert shown.explained > 0.9
    assert token_map(members, {"c0": None}).bursts == 10


def test_names_of_bursts_at_one_place_do_not_cover_each_other():
    tokens = np.eye(16)[[0, 0, 0, 1]] + 0.01 * np.eye(16)[[2, 3, 4, 5]]
    shown = token_map(
        [Member(f"c{index}", token[None], token[None]) for index, token in enumerate(tokens)], {f"c{index}": None for index in range(4)}
    )
    for index, label in enumerate(shown.labels):
        for other in shown.labels[:index]:
            assert abs(label.x - other.x) >= LABEL_WIDTH or abs(label.y - other.y) >= LABEL_HEIGHT


def test_one_burst_is_drawn_too():
    shown = token_map([Member("c", np.zeros((1, 4)), np.ones((1, 4)))], {"c": "cup"})
    ((x, y),) = [(point.x, point.y) for point in shown.points]
    assert 0 < x < MAP_WIDTH
    assert 0 < y < HEIGHT

"""The pages of categories: what they show, what a form changes and takes back, and what a page costs where there are many."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.boxes import OrientedBox
from core.scan import ScanOptions
from service.agent import Agent, AgentConfig, ObserveOptions
from service.compute import in_this_process
from service.console.facts import health, symmetry_words, variance_bars
from store.connection import Connection
from store.memory import Memory
from store.overview import Summary

MANY = 500
OBSERVATIONS = 10_000


@pytest.fixture(scope="module")
def prepared(tmp_path_factory, colour_backbone, look):
    """A memory that knows a cup by two bursts and a mug by one, and their ids."""
    folder = tmp_path_factory.mktemp("prepared") / "memory"
    with Memory.open(folder) as memory:
        agent = Agent(in_this_process(colour_backbone), memory, AgentConfig(score="pooled_best_view", variant="ucd"))
        ids = {}
        for name, kind in (("cup", "bright"), ("mug", "dark")):
            scan = agent.scanning.begin(look(kind), ScanOptions(6))
            agent.scanning.add(scan.id, look(kind))
            ids[name] = agent.scanning.complete(scan.id, name).id
        agent.observe(look(), ObserveOptions(ids["cup"]))
    return folder, ids


@pytest.fixture
def settings(settings, prepared):
    """On a copy of it."""
    shutil.copytree(prepared[0], settings.data_dir)
    return settings


@pytest.fixture
def cup(prepared):
    """The category of two bursts."""
    return prepared[1]["cup"]


@pytest.fixture
def mug(prepared):
    """The other one."""
    return prepared[1]["mug"]


def test_the_grid_shows_every_category(client, cup, mug):
    text = client.get("/categories").text
    assert "2 categories" in text
    for category_id, name in ((cup, "cup"), (mug, "mug")):
        assert f'href="/categories/{category_id}">{name}<' in text
        assert f"/categories/{category_id}/cover.png" in text


def test_an_empty_memory_says_how_categories_come(client):
    for each in client.get("/v1/categories").json()["categories"]:
        client.delete(f"/v1/categories/{each['id']}")
    assert "Nothing was learnt yet" in client.get("/categories").text


def test_names_are_searched(client, cup, mug):
    assert "cup" not in client.get("/categories", params={"called": "MU"}).text
    assert "mug" in client.get("/categories", params={"called": "MU"}).text
    assert "mug" in client.get("/categories", params={"called": mug[:6]}).text
    assert "No category is called so" in client.get("/categories", params={"called": "%"}).text


def test_a_search_gets_the_grid_alone(client, cup):
    answer = client.get("/categories", headers={"HX-Request": "true", "HX-Target": "grid"})
    assert "<html" not in answer.text
    assert "2 categories" in answer.text


def test_a_cover_is_kept_by_browsers(client, cup):
    first = client.get(f"/categories/{cup}/cover.png?side=120")
    assert first.headers["content-type"] == "image/png"
    assert client.get(f"/categories/{cup}/cover.png?side=120", headers={"If-None-Match": first.headers["etag"]}).status_code == 304


def test_a_category_shows_what_it_was_learnt_from(client, cup):
    text = client.get(f"/categories/{cup}").text
    for kind in ("rgb", "foreground", "pca", "overlay"):
        assert len(set(re.findall(rf"/views/\d/{kind}.png", text))) == 6
    assert f'data-scene="/categories/{cup}/scene"' in text
    assert "1 observation<" in text
    assert "somebody naming it" in text
    assert len(re.findall('type="checkbox"', text)) == 2


def test_a_category_that_is_not_there_is_a_page_that_says_so(client):
    answer = client.get("/categories/none")
    assert answer.status_code == 404
    assert answer.headers["content-type"].startswith("text/html")


def test_a_category_whose_reference_is_damaged_says_so_and_can_be_deleted(client, cup, settings):
    (settings.data_dir / "categories" / cup / "reference.npz").write_bytes(b"")
    page = client.get(f"/categories/{cup}")
    assert page.status_code == 200
    assert re.search(r'role="alert">\s*<strong>Its reference is damaged</strong>\s*<p>[^<]*reference.npz', page.text)
    assert set(re.findall(r"/views/\d/(\w+).png", page.text)) == {"rgb"}
    assert "data-scene" not in page.text
    assert 'class="health' not in page.text
    assert len(re.findall('type="checkbox"', page.text)) == 2
    assert f'href="/categories/{cup}/delete"' in page.text
    assert client.get(f"/categories/{cup}/delete").status_code == 200
    follow(client, f"/categories/{cup}/delete")
    assert client.get(f"/categories/{cup}").status_code == 404


def test_the_scene_is_the_reference(client, cup):
    scene = client.get(f"/categories/{cup}/scene").json()
    assert [cloud["choice"] for cloud in scene["clouds"]] == ["Image", "Components"]
    assert len(scene["cameras"]) == 6
    (box,) = scene["boxes"]
    for cloud in scene["clouds"]:
        assert len(cloud["points"]) == len(cloud["colours"]) > 300
        for axis in range(3):
            edges = [corner[axis] for corner in box["corners"]]
            reach = max(edges) - min(edges)
            assert min(edges) - 0.1 * reach <= min(cloud["points"][axis::3]) <= max(cloud["points"][axis::3]) <= max(edges) + 0.1 * reach
    assert scene["up"][2] == pytest.approx(1, abs=0.05)


def test_what_it_is_confused_with_comes_most_alike_first(client, cup, mug):
    text = client.get(f"/categories/{cup}/nearest").text
    assert "mug" in text
    assert f"/categories/{cup}/merge?into={mug}" in text
    assert "Its own bursts reach" in text


def follow(client, address, **fields):
    """Sends a form; the page it leads to."""
    answer = client.post(address, data=fields)
    assert answer.status_code == 200, answer.text
    return answer


def undo_of(page):
    """Where the note on a page takes its change back."""
    return re.search(r'<div class="note good done".*?action="([^"]+)"', page.text, re.DOTALL)[1]


def test_a_rename_and_the_way_back(client, cup):
    page = follow(client, f"/categories/{cup}/rename", name="  tea cup ")
    assert "Renamed “cup” to “tea cup”" in page.text
    assert client.get(f"/v1/categories/{cup}").json()["name"] == "tea cup"
    assert "Took back: rename" in follow(client, undo_of(page)).text
    assert client.get(f"/v1/categories/{cup}").json()["name"] == "cup"


def test_a_change_says_that_it_was_made_at_the_console(client, cup):
    follow(client, f"/categories/{cup}/rename", name="goblet")
    assert client.get("/v1/memory/audit").json()["entries"][0]["actor"] == "console"


def test_a_merge_tells_what_it_changes_changes_it_and_can_be_taken_back(client, cup, mug):
    assert "mug" in client.get(f"/categories/{cup}/merge").text
    preview = client.get(f"/categories/{cup}/merge", params={"into": mug}).text
    assert re.search(r"1 \+ 2 = <b>3</b>", preview)
    assert client.get("/v1/info").json()["categories"] == 2
    page = follow(client, f"/categories/{cup}/merge", into=mug)
    assert page.url.path == f"/categories/{mug}"
    assert "Merged “cup” into “mug”, 2 bursts" in page.text
    assert client.get(f"/v1/categories/{mug}").json()["instances"] == 3
    follow(client, undo_of(page))
    assert client.get(f"/v1/categories/{cup}").json()["instances"] == 2


def test_chosen_bursts_are_split_off(client, cup):
    instances = client.get(f"/v1/categories/{cup}/instances").json()["instances"]
    page = follow(client, f"/categories/{cup}/split", instance=[instances[1]["id"]], name="bowl")
    assert page.url.path != f"/categories/{cup}"
    assert "Split 1 burst off “cup” as “bowl”" in page.text
    follow(client, undo_of(page))
    assert client.get(f"/v1/categories/{cup}").json()["instances"] == 2


def test_nothing_chosen_is_told(client, cup):
    answer = client.post(f"/categories/{cup}/split", data={"name": "bowl"})
    assert answer.status_code == 422
    assert answer.headers["content-type"].startswith("text/html")


def test_a_burst_is_forgotten_and_brought_back(client, cup):
    instances = client.get(f"/v1/categories/{cup}/instances").json()["instances"]
    page = follow(client, f"/categories/{cup}/forget", instance=instances[1]["id"])
    assert client.get(f"/v1/categories/{cup}").json()["instances"] == 1
    follow(client, undo_of(page))
    assert client.get(f"/v1/categories/{cup}").json()["instances"] == 2


def test_a_deletion_asks_first_and_can_be_taken_back(client, cup):
    assert "2 bursts" in client.get(f"/categories/{cup}/delete").text
    page = follow(client, f"/categories/{cup}/delete")
    assert page.url.path == "/categories"
    assert "Deleted “cup” with 2 bursts" in page.text
    assert client.get("/v1/info").json()["categories"] == 1
    assert follow(client, undo_of(page)).url.path == f"/categories/{cup}"


def test_a_change_that_is_undone_already_is_told(client, cup):
    address = undo_of(follow(client, f"/categories/{cup}/rename", name="bowl"))
    follow(client, address)
    again = client.post(address)
    assert again.status_code == 409
    assert "undone already" in again.text


def test_a_made_up_change_is_not_told(client, cup):
    assert "note good done" not in client.get("/categories", params={"change": "none"}).text


def test_names_are_text_and_never_markup(client, cup, mug):
    for each in (cup, mug):
        client.patch(f"/v1/categories/{each}", json={"name": "<img src=x onerror=alert(1)>\"'"}, headers={"X-Actor": "<script>"})
    for path in ("", f"/{cup}", f"/{cup}/nearest", f"/{cup}/merge", f"/{cup}/merge?into={mug}", f"/{cup}/delete"):
        text = client.get(f"/categories{path}").text
        assert "<img src=x" not in text
        assert "<script>" not in text
        assert "&lt;img src=x onerror=alert(1)&gt;" in text


def summary(**changes):
    """Of a category that does well."""
    good = {"views": 10, "instances": 5, "recognised": 4, "without_pose": 0}
    return Summary(id="0", name=None, created_at="", last_seen="", **(good | changes))


@pytest.mark.parametrize(
    ("changes", "word"),
    [({}, "good"), ({"without_pose": 2}, "poses fail"), ({"views": 3}, "few views"), ({"instances": 1, "recognised": 0}, "seen once")],
)
def test_health_says_what_to_mend(changes, word):
    assert health(summary(**changes)).word == word


def test_what_was_recognised_and_did_not_join_was_seen_all_the_same():
    told = health(summary(instances=1, recognised=1))
    assert (told.word, told.why) == ("good", "1 burst, and 1 pose among those kept")


def test_symmetries_are_worded_by_their_axis():
    class Shown:
        box = OrientedBox(np.eye(4), np.ones(3))
        symmetries = np.concatenate(
            [
                Rotation.from_rotvec([[0, 0, 2 * np.pi * k / 12] for k in range(1, 12)]).as_matrix(),
                Rotation.from_rotvec([[np.pi, 0, 0]]).as_matrix(),
            ]
        )

    assert symmetry_words(Shown()) == ["any turn about its z axis", "a half turn about its x axis"]
    Shown.symmetries = Shown.symmetries[:0]
    assert symmetry_words(Shown()) == []


def test_bars_are_as_long_as_their_share_of_the_longest():
    bars = variance_bars([0.5, 0.25, 0.125])
    assert [bar.length for bar in bars] == [1, 0.5, 0.25]
    assert bars[-1].cumulative == 0.875
    assert variance_bars([]) == []


@pytest.fixture
def crowded(client, cup):
    """The service once it knows 500 categories and 10,000 observations: copies of the rows of one."""
    with client.app.state.running.agent.memory._connection.change() as db:
        for table, count in (("categories", MANY - 2), ("observations", OBSERVATIONS), ("instances", 2 * MANY)):
            own = "name" if table == "categories" else "category_id"
            copied = [column.name for column in db.table(table).columns if column.name not in {"id", own}]
            value = "'category ' || n" if own == "name" else f"CASE n % {MANY - 1} WHEN 0 THEN '{cup}' ELSE 'c' || (n % {MANY - 1}) END"
            (row_id,) = db.execute(f"SELECT id FROM {table} ORDER BY rowid DESC LIMIT 1").fetchone()
            numbers = f"WITH RECURSIVE counted(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM counted WHERE n < {count})"
            select = f"SELECT '{table[0]}' || n, {value}, {', '.join(copied)} FROM {table}, counted WHERE id = '{row_id}'"
            db.execute(f"{numbers} INSERT INTO {table} (id, {own}, {', '.join(copied)}) {select}")
    return client


def test_a_crowded_memory_is_asked_little(crowded, monkeypatch):
    """A page takes as many queries with 500 categories as with one, none of them looks at every observation, and no file is read."""
    asked = []
    rows = Connection.rows

    def counted(connection, sql, *parameters):
        asked.append((sql, parameters))
        return rows(connection, sql, *parameters)

    monkeypatch.setattr(Connection, "rows", counted)
    for path in ("", "?order=seen&page=7", "?order=instances", "?called=category 49"):
        asked.clear()
        answer = crowded.get(f"/categories{path}")
        assert answer.status_code == 200
        assert len(asked) <= 3
        for sql, parameters in list(asked):
            plan = rows(crowded.app.state.running.agent.memory._connection, f"EXPLAIN QUERY PLAN {sql}", *parameters)
            assert not [step["detail"] for step in plan if re.match("SCAN (o|observations|i|instances)\\b", step["detail"])]
    assert f"{MANY} categories, page 1 of 11" in crowded.get("/categories").text

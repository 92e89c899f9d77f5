"""What a person says an observation was of: the burst goes there, nothing is lost, and it can be taken back."""

from __future__ import annotations

import pytest


@pytest.fixture
def seen(client, ball, look, parts):
    """An observation of it, whose burst joined it."""
    answer = client.post("/v1/observations", files=parts(look())).json()
    assert (answer["outcome"], instances(client, ball)) == ("known", 2)
    return answer


def instances(client, category):
    return client.get(f"/v1/categories/{category['id']}").json()["instances"]


def correct(client, seen, category_id=None, **more):
    return client.post(f"/v1/observations/{seen['id']}/correct", json={"category_id": category_id, **more}, headers={"X-Actor": "anna"})


def undo_last(client):
    return client.post(f"/v1/memory/audit/{client.get('/v1/memory/audit').json()['entries'][0]['id']}/undo")


def test_a_burst_moves_to_the_category_it_was_of(client, ball, seen, learn):
    stone = learn("dark", "stone")
    corrected = correct(client, seen, stone["id"])
    assert corrected.status_code == 200
    assert (corrected.json()["corrected_to"], corrected.json()["category_id"]) == (stone["id"], ball["id"])
    assert (instances(client, ball), instances(client, stone)) == (1, 2)
    found = client.get(f"/v1/categories/{stone['id']}/instances").json()["instances"]
    (moved,) = [each for each in found if each["source_id"] == seen["id"]]
    assert (moved["how"], moved["similarity"]) == ("named", None)


def test_undoing_puts_everything_back(client, ball, seen, learn):
    stone = learn("dark", "stone")
    before = client.get(f"/v1/categories/{ball['id']}/instances").json()
    correct(client, seen, stone["id"])
    assert undo_last(client).status_code == 200
    assert (instances(client, ball), instances(client, stone)) == (2, 1)
    assert {each["id"]: each for each in client.get(f"/v1/categories/{ball['id']}/instances").json()["instances"]} == {
        each["id"]: each for each in before["instances"]
    }
    assert client.get(f"/v1/observations/{seen['id']}").json()["corrected_to"] is None


def test_what_was_asked_without_learning_joins(client, ball, look, parts):
    asked = client.post("/v1/observations", files=parts(look()), params={"learn": False}).json()
    assert instances(client, ball) == 1
    correct(client, asked, ball["id"])
    assert instances(client, ball) == 2
    undo_last(client)
    assert instances(client, ball) == 1


def test_a_new_category_is_made_of_the_views(client, ball, seen, look, parts):
    corrected = correct(client, seen, name="egg").json()
    egg = client.get(f"/v1/categories/{corrected['corrected_to']}").json()
    assert (egg["name"], egg["views"], egg["instances"]) == ("egg", 6, 1)
    assert instances(client, ball) == 1
    named = client.post("/v1/observations", files=parts(look()), params={"category_id": egg["id"]}).json()
    assert named["pose"] is not None
    entry = client.get("/v1/memory/audit").json()["entries"][0]
    assert (entry["action"], entry["actor"], entry["category_id"]) == ("correct", "anna", egg["id"])


def test_undoing_a_new_category_forgets_it(client, ball, seen):
    egg = correct(client, seen, name="egg").json()["corrected_to"]
    undo_last(client)
    assert client.get(f"/v1/categories/{egg}").status_code == 404
    assert instances(client, ball) == 2


def test_a_new_category_that_others_joined_since_is_not_undone(client, seen, look, parts):
    egg = correct(client, seen).json()["corrected_to"]
    entry = client.get("/v1/memory/audit").json()["entries"][0]["id"]
    client.post("/v1/observations", files=parts(look()), params={"category_id": egg})
    refused = client.post(f"/v1/memory/audit/{entry}/undo")
    assert refused.status_code == 409
    assert client.get(f"/v1/categories/{egg}").json()["instances"] == 2


def test_a_burst_that_is_there_already_stays(client, ball, seen):
    refused = correct(client, seen, ball["id"])
    assert refused.status_code == 409
    assert "already" in refused.json()["detail"]


def test_the_last_burst_of_a_category_does_not_leave_it(client, ball, seen, learn):
    stone = learn("dark", "stone")
    first = client.get(f"/v1/categories/{ball['id']}/instances").json()["instances"][0]
    client.delete(f"/v1/categories/{ball['id']}/instances/{first['id']}")
    refused = correct(client, seen, stone["id"])
    assert refused.status_code == 409
    assert (instances(client, ball), instances(client, stone)) == (1, 1)


def test_views_without_depth_make_no_category(client, ball, look, parts):
    flat = client.post("/v1/observations", files=parts(look(), lambda about, files: files.update(depth=[]))).json()
    refused = correct(client, flat)
    assert refused.status_code == 409
    assert "scan the object instead" in refused.json()["detail"]


def test_who_names_what_is_not_new_is_told(client, ball, seen):
    refused = correct(client, seen, ball["id"], name="egg")
    assert (refused.status_code, refused.json()["detail"].split(":")[0]) == (422, "body")


def test_what_there_is_not_is_told(client, ball, seen):
    assert correct(client, seen, "0" * 32).status_code == 404
    assert correct(client, {"id": "0" * 32}, ball["id"]).status_code == 404

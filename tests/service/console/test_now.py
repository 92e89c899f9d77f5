"""What happens now: the latest observations, scans as they fill, and what was learnt."""

from __future__ import annotations

import re

import numpy as np


def test_an_observation_tells_its_decision(client, ball, look, parts):
    client.post("/v1/observations", files=parts(look()))
    text = client.get("/").text
    assert "ball" in text
    assert re.search(r'aria-label="Similarity 1\.00 against a threshold of 0\.40"', text)
    assert re.search(r"<li>6 views</li>\s+<li>\d+ ms</li>", text)


def test_scans_fill_as_views_arrive(client, look, parts):
    scan = client.post("/v1/scans", files=parts(look())).json()
    assert "0 of 10 viewpoints are covered" in client.get("/now/side").text
    client.post(f"/v1/scans/{scan['id']}/views", files=parts(look(poses=np.array(scan["world_from_camera"][:3]))))
    assert "3 of 10 viewpoints are covered" in client.get("/now/side").text


def test_what_was_learnt_is_told(client, ball):
    client.patch(f"/v1/categories/{ball['id']}", json={"name": "egg"})
    text = client.get("/now/side").text
    assert "Learnt “ball” from 6 views" in text
    assert "Renamed “ball” to “egg”" in text


def test_events_are_heard_from_where_the_page_ends(client, look, parts):
    client.post("/v1/observations", files=parts(look()))
    assert 'data-after="1"' in client.get("/").text


def test_a_card_is_sent_alone(client, look, parts):
    seen = client.post("/v1/observations", files=parts(look())).json()
    text = client.get(f"/observations/{seen['id']}/card").text
    assert text.lstrip().startswith(f'<li class="seen" id="seen-{seen["id"]}">')

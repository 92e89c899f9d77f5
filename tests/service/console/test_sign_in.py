"""A key becomes a session: who gets one, what it allows, and when it ends."""

from __future__ import annotations

import re

import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.console.sign_in import own_address
from store.keys import ROLES
from store.memory import Memory

PAGES = ("/", "/observations")


@pytest.fixture
def keys(settings):
    """A key of each role, and one's id that can be revoked."""
    with Memory.keyring(settings.data_dir) as ring:
        return {role: ring.create(role, role) for role in ROLES}


@pytest.fixture
def client(settings, keys, backbone):
    """A service that asks for keys; follows no redirection."""
    with TestClient(create_app(settings, backbone=backbone), follow_redirects=False) as opened:
        yield opened


def sign_in(client, keys, role):
    """As a browser does; the client keeps the cookie."""
    return client.post("/sign-in", data={"key": keys[role][1], "next": "/observations?outcome=novel"})


@pytest.mark.parametrize("path", PAGES)
def test_pages_lead_to_the_sign_in_and_back(client, path):
    answer = client.get(path, params={"outcome": "novel"} if path != "/" else None)
    assert answer.status_code == 303
    wanted = {"/": "/sign-in?next=%2F", "/observations": "/sign-in?next=%2Fobservations%3Foutcome%3Dnovel"}[path]
    assert answer.headers["location"] == wanted
    shown = client.get(answer.headers["location"])
    assert shown.status_code == 200
    assert 'type="password"' in shown.text
    assert "<nav" not in shown.text


def test_a_part_of_a_page_leads_the_whole_page_there(client):
    answer = client.get("/observations", headers={"HX-Request": "true"})
    assert (answer.status_code, answer.headers["hx-redirect"]) == (401, "/sign-in?next=%2F")


def test_a_key_becomes_a_session(client, keys):
    answer = sign_in(client, keys, "viewer")
    assert (answer.status_code, answer.headers["location"]) == (303, "/observations?outcome=novel")
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert "max-age=43200" in cookie
    assert keys["viewer"][1].lower() not in cookie
    page = client.get("/")
    assert page.status_code == 200
    assert re.search(r"<b>viewer</b>\s+viewer", page.text)
    assert client.get("/v1/categories").status_code == 200


def test_the_cookie_travels_by_https_only_where_the_service_is_reached_so(settings, keys, backbone):
    with TestClient(create_app(settings, backbone=backbone), base_url="https://robot.example", follow_redirects=False) as client:
        assert "secure" in sign_in(client, keys, "viewer").headers["set-cookie"].lower()


def test_a_wrong_key_is_told_and_starts_nothing(client):
    answer = client.post("/sign-in", data={"key": "onelook_0_0"})
    assert answer.status_code == 401
    assert "no key of this service" in answer.text
    assert "set-cookie" not in answer.headers


def test_a_session_has_the_role_of_its_key(client, keys):
    sign_in(client, keys, "robot")
    assert client.post("/v1/memory/backup").status_code == 403
    sign_in(client, keys, "admin")
    assert client.post("/v1/memory/backup").status_code == 201
    assert client.get("/v1/memory/audit").json()["entries"][0]["actor"] == "admin"


def test_another_sites_page_cannot_use_it(client, keys):
    sign_in(client, keys, "admin")
    for sent in ({"Origin": "https://evil.example"}, {"Sec-Fetch-Site": "cross-site"}):
        assert client.post("/v1/memory/backup", headers=sent).status_code == 403
        assert client.post("/sign-out", headers=sent).status_code == 403
    assert client.get("/").status_code == 200


def test_signing_out_ends_it_here_and_there(client, keys):
    sign_in(client, keys, "viewer")
    token = client.cookies["onelook_session"]
    answer = client.post("/sign-out")
    assert (answer.status_code, answer.headers["location"]) == (303, "/sign-in")
    assert "onelook_session" not in client.cookies
    client.cookies.set("onelook_session", token)
    assert client.get("/").status_code == 303


def test_a_revoked_key_ends_its_sessions(client, keys, settings):
    sign_in(client, keys, "viewer")
    with Memory.keyring(settings.data_dir) as ring:
        ring.revoke(keys["viewer"][0].id)
    assert client.get("/").status_code == 303


def test_where_there_are_no_keys_there_is_nothing_to_sign_in_to(settings, backbone):
    empty = settings.model_copy(update={"data_dir": settings.data_dir.with_name("empty")})
    with TestClient(create_app(empty, backbone=backbone), follow_redirects=False) as client:
        assert client.get("/sign-in").headers["location"] == "/"
        assert "Sign out" not in client.get("/").text


@pytest.mark.parametrize(
    "address",
    ["https://evil.example", "//evil.example", "//[", "/\\evil.example", "javascript:alert(1)", "", "evil", "/\n/evil", "/\t/evil"],
)
def test_nobody_is_led_away(address):
    assert own_address(address) == "/"


def test_addresses_of_this_service_stay():
    assert own_address("/categories/1?x=2") == "/categories/1?x=2"

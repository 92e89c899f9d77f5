"""What every page has in common, on the synthetic world."""

from __future__ import annotations

import re

import pytest

from service.console.pages import NAVIGATION

PAGES = [link.path for link in NAVIGATION]


@pytest.mark.parametrize("path", PAGES)
def test_pages_open_on_an_empty_memory(client, path):
    assert client.get(path).status_code == 200


@pytest.mark.parametrize("path", ["/", "/observations"])
def test_an_empty_history_says_so(client, path):
    assert "Nothing was looked at yet" in client.get(path).text


@pytest.mark.parametrize("path", [*PAGES, "/observations/none", "/observations?outcome=odd"])
def test_scripts_and_styles_come_from_this_service_only(client, path):
    answer = client.get(path)
    policy = dict(part.strip().partition(" ")[::2] for part in answer.headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'none'"
    assert policy["script-src"] == policy["style-src"] == policy["connect-src"] == "'self'"
    assert policy["frame-ancestors"] == "'none'"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert not re.search(r"<script(?![^>]* src=\"/)[^>]*>|<style|\sstyle=|\son\w+=|javascript:", answer.text)


def test_a_wrong_address_is_answered_with_a_page_that_says_so(client):
    answer = client.get("/observations?outcome=odd")
    assert answer.status_code == 422
    assert answer.headers["content-type"].startswith("text/html")
    assert "outcome: Input should be" in answer.text


def test_a_part_of_a_page_gets_a_part_as_answer(client):
    answer = client.get("/observations?outcome=odd", headers={"HX-Request": "true"})
    assert "<html" not in answer.text
    assert 'role="alert"' in answer.text


def test_the_page_one_is_on_is_marked(client):
    for path in PAGES:
        assert re.findall(r'<a href="([^"]+)" aria-current="page">', client.get(path).text) == [path]


def test_names_are_text_and_never_markup(client, learn, look, parts):
    name = "<img src=x onerror=alert(1)>\"'"
    learn("bright", name)
    client.post("/v1/observations", files=parts(look()))
    for path in PAGES:
        assert "<img src=x" not in client.get(path).text
    for path in ("/", "/categories", "/observations"):
        assert "&lt;img src=x onerror=alert(1)&gt;" in client.get(path).text

"""Who may open which page, and send which form: every route of the console by every role."""

from __future__ import annotations

import pytest
from fastapi.testclient import TestClient

from service.access import ACCESS
from service.app import create_app
from service.console.install import ROUTERS
from service.settings import Settings
from store.keys import ROLES
from store.memory import Memory
from tests.service.conftest import with_keys

OPEN = {"/sign-in", "/sign-out"}
FORMS = ("/merge", "/delete")
"""Pages that lead to a change."""
STARTS = "/try/demo"
"""Begins a process, so nobody who may is asked to."""


ROUTES = sorted((method, route.path, route.kind + route.name) for router in ROUTERS for route in router.routes for method in route.methods)


@pytest.fixture(scope="module")
def guarded(tmp_path_factory, colour_backbone):
    """(client, header by role) of a service that has a key of each role."""
    folder = tmp_path_factory.mktemp("roles") / "memory"
    with Memory.keyring(folder) as keys:
        headers = with_keys(keys)
    with TestClient(create_app(Settings(data_dir=folder), backbone=colour_backbone), follow_redirects=False) as client:
        yield client, headers


def test_the_table_has_every_page_and_nothing_else():
    assert {name for _, _, name in ROUTES} == {name for name in ACCESS if name.startswith("console_")}
    assert len(ROUTES) > 25


@pytest.mark.parametrize(("method", "path", "name"), ROUTES, ids=[f"{method} {path}" for method, path, _ in ROUTES])
def test_every_page_lets_in_whom_it_should(guarded, method, path, name):
    client, headers = guarded
    url = path.format(category_id="0", observation_id="0", entry_id="0")
    nobody = client.request(method, url)
    if path in OPEN:
        assert nobody.status_code not in {401, 403}
        return
    led = nobody.status_code == 303 and nobody.headers["location"].startswith("/sign-in?")
    assert nobody.status_code == 401 if path.endswith(".png") else led
    reads = method == "GET" and not path.endswith(FORMS)
    for role in ROLES:
        allowed = reads or role == "admin"
        if allowed and method == "POST" and path.startswith(STARTS):
            continue
        answer = client.request(method, url, headers=headers[role])
        assert (answer.status_code == 403) is not allowed, f"{role} got {answer.status_code}"
        assert answer.status_code != 500

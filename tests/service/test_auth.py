"""Who is let in: every operation by every role, and what else could let somebody in."""

from __future__ import annotations

import asyncio
from datetime import timedelta
from typing import Any

import pytest
from fastapi import APIRouter, FastAPI
from fastapi.testclient import TestClient
from starlette.testclient import WebSocketDenialResponse

from clients.asynchronous import AsyncRobotClient
from clients.errors import NoKeyProblem, NotAllowedProblem, TooOftenProblem
from clients.exchange import Retry
from clients.robot import RobotClient
from core.views import Burst
from service.access import ACCESS, needed_role
from service.app import create_app
from service.guarded import include
from service.rate import RateLimit
from service.settings import Settings
from store.keys import ROLES
from store.memory import Memory
from tests.service.conftest import with_keys

DOCUMENT = create_app(Settings()).openapi()
OPERATIONS = [
    (method, path, operation)
    for path, methods in DOCUMENT["paths"].items()
    for method, operation in methods.items()
    if path != "/v1/events"  # never ends; has a test of its own
]
OPEN = {"healthz", "readyz"}
READS = {operation["operationId"] for method, _, operation in OPERATIONS if method == "get"} - OPEN
ROBOTS = {"observe", "begin_scan", "exclude_viewpoints", "add_scan_views", "complete_scan", "delete_scan", "create_goal", "plan"}


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: Any, colour_backbone: Any) -> Any:
    """(client, header by role) of a service that has a key of each role."""
    folder = tmp_path_factory.mktemp("guarded") / "memory"
    with Memory.keyring(folder) as keys:
        headers = with_keys(keys)
    settings = Settings(data_dir=folder, variant="ucd", rate_limit=100_000)
    with TestClient(create_app(settings, backbone=colour_backbone)) as client:
        yield client, headers


@pytest.fixture
def client(guarded: Any) -> TestClient:
    """Of that service."""
    return guarded[0]


@pytest.fixture
def headers(guarded: Any) -> dict[str, dict[str, str]]:
    """By role."""
    return guarded[1]


def guarded_memory(client: TestClient) -> Memory:
    """Of the service that `client` asks."""
    return client.app.state.running.agent.memory


def expected(operation: str) -> str | None:
    """The least role, from what an operation does, told again independently of the table."""
    return None if operation in OPEN else "viewer" if operation in READS else "robot" if operation in ROBOTS else "admin"


@pytest.mark.parametrize(
    ("method", "path", "operation"), OPERATIONS, ids=lambda each: each if isinstance(each, str) else each["operationId"]
)
def test_every_operation_lets_in_whom_it_should(method: str, path: str, operation: Any, client: TestClient, headers: Any) -> None:
    """Ids that are not there and bodies that are empty are enough: nobody hears of them who may not ask."""
    needed = expected(operation["operationId"])
    url = path.format(**dict.fromkeys(("category_id", "observation_id", "scan_id", "goal_id", "instance_id", "entry_id", "view"), "0"))
    nobody = client.request(method, url)
    assert (nobody.status_code == 401) is (needed is not None)
    for role in ROLES:
        answer = client.request(method, url, headers=headers[role])
        allowed = needed is None or ROLES.index(role) >= ROLES.index(needed)
        assert answer.status_code not in {401, 429}
        assert (answer.status_code != 403) is allowed, f"{role} got {answer.status_code}"
        assert answer.status_code != 500
    documented = {401, 403, 429} <= {int(status) for status in operation["responses"]}
    assert documented is ("security" in operation) is (needed is not None)
    assert operation.get("x-role") == needed


def test_the_table_has_every_operation_and_nothing_else() -> None:
    console = {name for name in ACCESS if name.startswith("console_")}
    known = {operation["operationId"] for methods in DOCUMENT["paths"].values() for operation in methods.values()}
    assert set(ACCESS) - console == known | {"track"}


def test_a_route_that_the_table_lacks_is_told_where_the_table_is():
    with pytest.raises(LookupError, match=r"'things'.*service/access\.py"):
        needed_role("things")


def test_a_route_that_asks_nobody_who_they_are_does_not_start():
    router = APIRouter()

    @router.get("/v1/things")
    def things() -> None: ...

    with pytest.raises(LookupError, match="route_class"):
        include(FastAPI(), [router])


def test_the_scheme_is_documented() -> None:
    (scheme,) = DOCUMENT["components"]["securitySchemes"].values()
    assert (scheme["type"], scheme["scheme"]) == ("http", "bearer")


def test_refusals_are_problems_with_types_of_their_own(client: TestClient, headers: Any) -> None:
    nobody = client.get("/v1/categories")
    assert nobody.headers["content-type"] == "application/problem+json"
    assert nobody.headers["www-authenticate"].startswith("Bearer")
    assert nobody.json()["type"] == "urn:onelook:problem:no-key"
    assert "ONELOOK_API_KEY" in nobody.json()["detail"]
    viewer = client.delete("/v1/categories/0", headers=headers["viewer"])
    assert viewer.json()["type"] == "urn:onelook:problem:not-allowed"
    assert "admin" in viewer.json()["detail"]


@pytest.mark.parametrize("sent", ["Basic YTpi", "Bearer", "Bearer onelook_0_0", "onelook_0_0", "Bearer \xe9"])
def test_what_is_no_key_lets_nobody_in(client: TestClient, sent: str) -> None:
    assert client.get("/v1/info", headers={"Authorization": sent.encode("latin-1")}).status_code == 401


def test_a_wrong_key_is_refused_where_the_session_is_right(client: TestClient) -> None:
    """Whoever sends a key means that one."""
    key = guarded_memory(client).keys.all()[0]
    cookie = f"onelook_session={guarded_memory(client).sessions.begin(key, timedelta(hours=1))}"
    assert client.get("/v1/info", headers={"Cookie": cookie}).status_code == 200
    assert client.get("/v1/info", headers={"Cookie": cookie, "Authorization": "Bearer onelook_0_0"}).status_code == 401


def test_neither_a_cached_nor_a_repeated_answer_is_a_way_in(client: TestClient, headers: Any) -> None:
    tag = client.get("/v1/categories", headers=headers["viewer"]).headers["etag"]
    assert client.get("/v1/categories", headers={"If-None-Match": tag}).status_code == 401
    rate, key = {"false_known_rate": 0.02}, {"Idempotency-Key": "once"}
    for given, status in ((headers["admin"], 200), (headers["admin"], 200), (headers["robot"], 403), ({}, 401)):
        assert client.post("/v1/memory/calibrate", json=rate, headers=given | key).status_code == status


def test_the_body_of_a_stranger_is_not_judged(client: TestClient) -> None:
    """What is wrong with it is not told either."""
    assert client.post("/v1/categories/0/merge", content=b"{" * 100).status_code == 401


def test_events_take_a_key(client: TestClient) -> None:
    assert client.get("/v1/events").status_code == 401


def test_a_followed_object_takes_a_robots_key(client: TestClient, headers: Any) -> None:
    for given, status in (({}, 401), (headers["viewer"], 403)):
        with pytest.raises(WebSocketDenialResponse) as refused, client.websocket_connect("/v1/track", headers=given):
            pass
        assert refused.value.status_code == status
        assert refused.value.json()["status"] == status
    with client.websocket_connect("/v1/track", headers=headers["robot"]) as socket:
        socket.send_json({"type": "hello"})
        assert socket.receive_json()["type"] == "ready"


def test_a_revoked_key_is_out_at_once(settings: Settings, backbone: Any) -> None:
    with TestClient(create_app(settings, backbone=backbone)) as client:
        assert client.get("/v1/info").status_code == 200
        with Memory.keyring(settings.data_dir) as keys:
            key, text = keys.create("arm", "robot")
        header = {"Authorization": f"Bearer {text}"}
        assert (client.get("/v1/info").status_code, client.get("/v1/info", headers=header).status_code) == (401, 200)
        with Memory.keyring(settings.data_dir) as keys:
            keys.revoke(key.id)
        assert (client.get("/v1/info").status_code, client.get("/v1/info", headers=header).status_code) == (401, 401)


def test_the_audit_trail_names_the_key(settings: Settings, backbone: Any) -> None:
    with Memory.keyring(settings.data_dir) as keys:
        text = keys.create("anna", "admin")[1]
    with TestClient(create_app(settings, backbone=backbone), headers={"Authorization": f"Bearer {text}"}) as client:
        client.post("/v1/memory/backup", headers={"X-Actor": "night shift"})
        client.post("/v1/memory/export")
        entries = client.get("/v1/memory/audit").json()["entries"]
    assert [(entry["action"], entry["actor"]) for entry in entries[:1]] == [("backup", "anna (night shift)")]


def test_a_key_that_asks_too_often_waits_and_the_others_do_not(settings: Settings, backbone: Any) -> None:
    with Memory.keyring(settings.data_dir) as keys:
        busy, calm = ({"Authorization": f"Bearer {keys.create(name, 'viewer')[1]}"} for name in ("busy", "calm"))
    with TestClient(create_app(settings.model_copy(update={"rate_limit": 3}), backbone=backbone)) as client:
        statuses = [client.get("/v1/info", headers=busy).status_code for _ in range(4)]
        refused = client.get("/v1/info", headers=busy)
        assert statuses == [200, 200, 200, 429]
        assert refused.json()["type"] == "urn:onelook:problem:too-often"
        assert 1 <= int(refused.headers["retry-after"]) <= 20
        assert client.get("/v1/info", headers=calm).status_code == 200


def test_a_bucket_fills_evenly() -> None:
    now = 0.0
    limit = RateLimit(2, clock=lambda: now)
    assert [limit.take("a"), limit.take("a")] == [0, 0]
    assert limit.take("a") == 30
    now = 10.0
    assert limit.take("a") == pytest.approx(20)
    now = 31.0
    assert limit.take("a") == 0
    assert limit.take("b") == 0
    now = 1e6
    assert [limit.take("a"), limit.take("a")] == [0, 0]
    assert limit.take("a") > 0


CROSS_SITE = [
    {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site"},
    {"Origin": "https://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://testserver:81"},
    {"Origin": "http://["},
]


@pytest.mark.parametrize("sent", CROSS_SITE, ids=str)
def test_other_sites_pages_change_nothing(settings: Settings, backbone: Any, sent: dict[str, str]) -> None:
    with TestClient(create_app(settings, backbone=backbone)) as client:
        refused = client.post("/v1/memory/backup", headers=sent)
        assert (refused.status_code, refused.json()["type"]) == (403, "urn:onelook:problem:not-allowed")
        with pytest.raises(WebSocketDenialResponse), client.websocket_connect("/v1/track", headers=sent):
            pass
        assert client.get("/v1/info", headers=sent).status_code == 200
    assert not settings.backups.exists()


@pytest.mark.parametrize("sent", [{}, {"Sec-Fetch-Site": "same-origin"}, {"Origin": "http://testserver"}], ids=str)
def test_its_own_pages_and_robots_do(settings: Settings, backbone: Any, sent: dict[str, str]) -> None:
    with TestClient(create_app(settings, backbone=backbone)) as client:
        assert client.post("/v1/memory/backup", headers=sent).status_code == 201


def test_without_keys_only_names_that_are_nobody_elses_are_answered(settings: Settings, backbone: Any) -> None:
    with TestClient(create_app(settings, backbone=backbone)) as client:
        for host, status in {"127.0.0.1:8000": 200, "localhost": 200, "[::1]:8000": 200, "robot.local": 200, "evil.example": 403}.items():
            assert client.get("/v1/info", headers={"Host": host}).status_code == status, host
        with Memory.keyring(settings.data_dir) as keys:
            header = {"Authorization": f"Bearer {keys.create('arm', 'viewer')[1]}"}
        assert client.get("/v1/info", headers={"Host": "robots.example"} | header).status_code == 200


def test_every_answer_has_the_headers_that_browsers_heed(client: TestClient) -> None:
    for path in ("/healthz", "/v1/info", "/nothing"):
        assert client.get(path).headers["x-content-type-options"] == "nosniff"
        assert client.get(path).headers["x-frame-options"] == "DENY"


def test_clients_send_their_key(settings: Settings, backbone: Any, serving: Any, look: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with Memory.keyring(settings.data_dir) as keys:
        robot_key, viewer_key = (keys.create(role, role)[1] for role in ("robot", "viewer"))
    with serving(settings.model_copy(update={"rate_limit": 12}), backbone) as url:
        with RobotClient(url) as stranger, pytest.raises(NoKeyProblem):
            stranger.info()
        with RobotClient(url, api_key=viewer_key) as viewer, pytest.raises(NotAllowedProblem):
            viewer.observe(look(views=2))
        with RobotClient(url, api_key=viewer_key) as viewer, pytest.raises(NotAllowedProblem), viewer.track():
            pass
        with RobotClient(url, api_key=robot_key) as robot, robot.track():
            assert robot.info().categories == 0
        monkeypatch.setenv("ONELOOK_API_KEY", robot_key)
        asyncio.run(_ask(url, look(views=2)))
        with RobotClient(url, retry=Retry(attempts=1)) as robot, pytest.raises(TooOftenProblem) as refused:
            _ask_often(robot)
        assert refused.value.retry_after_s is not None


def _ask_often(robot: RobotClient) -> None:
    for _ in range(12):
        robot.info()


async def _ask(url: str, burst: Burst) -> None:
    async with AsyncRobotClient(url) as robot, robot.track():
        assert (await robot.observe(burst)).outcome == "novel"

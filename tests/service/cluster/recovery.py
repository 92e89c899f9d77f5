"""What is killed comes back, and nothing that was answered is lost; run by `make cluster`, since it takes a minute."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import pytest

from tests.service.cluster.conftest import on_ray

BACK_S = 60


@pytest.fixture(scope="module")
def learnt(cluster: Any, look: Any, parts: Any) -> str:
    """A category's id."""
    scan = cluster.http.post("/v1/scans", files=parts(look())).json()
    cluster.http.post(f"/v1/scans/{scan['id']}/views", files=parts(look()))
    return str(cluster.http.post(f"/v1/scans/{scan['id']}/complete", json={"name": "lamp"}).json()["id"])


@contextmanager
def robots(count: int, errand: Callable[[httpx.Client, int], None], http: httpx.Client) -> Iterator[None]:
    """So many do their errand over and over; what fails in one fails the test."""
    over, failures = threading.Event(), []

    def robot(number: int) -> None:
        with httpx.Client(base_url=http.base_url, timeout=120) as own:
            while not over.is_set() and not failures:
                try:
                    errand(own, number)
                except Exception as error:
                    failures.append(error)

    threads = [threading.Thread(target=robot, args=(each,)) for each in range(count)]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        over.set()
        for thread in threads:
            thread.join()
    assert not failures, failures[0]


def until_back(cluster: Any, part: str, killed: int, count: int) -> float:
    """Seconds until as many are there as before."""
    start = time.monotonic()
    while time.monotonic() < start + BACK_S:
        there = cluster.processes(part)
        if killed not in there and len(there) == count:
            return time.monotonic() - start
        time.sleep(0.1)
    raise AssertionError(f"no {part} came in the place of the killed one")


@pytest.mark.parametrize("part", ["Encoder", "PoseSolver"])
def test_a_killed_replica_costs_no_answer(part: str, cluster: Any, learnt: str, look: Any, parts: Any) -> None:
    body = parts(look(views=4))
    answered = []

    def observe(http: httpx.Client, number: int) -> None:
        answer = http.post(f"/v1/observations?learn=false&category_id={learnt}", files=body)
        assert answer.status_code == 201, answer.text
        assert answer.json()["pose"] is not None
        answered.append(time.monotonic())

    with robots(4, observe, cluster.http):
        time.sleep(2)
        killed = next(iter(cluster.processes(part)))
        os.kill(killed, signal.SIGKILL)
        at = time.monotonic()
        until_back(cluster, part, killed, 2)
        time.sleep(1)
    assert [each for each in answered if each > at + 1], "nothing was answered afterwards"


def repeated(http: httpx.Client, path: str, key: str, **request: Any) -> httpx.Response:
    """As the clients do it: again with the same key until it is answered."""
    deadline = time.monotonic() + BACK_S
    while True:
        try:
            answer = http.post(path, headers={"Idempotency-Key": key}, **request)
            if answer.status_code < 500 and answer.status_code != 409:
                return answer
        except httpx.TransportError:
            pass
        assert time.monotonic() < deadline, f"{path} was not answered for {BACK_S} s"
        time.sleep(0.2)


def test_a_killed_owner_loses_nothing_that_was_answered(cluster: Any, learnt: str, look: Any, parts: Any) -> None:
    body = parts(look(views=3))
    asked = [0, 0]
    answered: list[str] = []
    versions: list[int] = []

    def observe(http: httpx.Client, number: int) -> None:
        asked[number] += 1
        key = f"robot-{number}-{asked[number]}"
        answer = repeated(http, f"/v1/observations?category_id={learnt}", key, files=body)
        assert answer.status_code in (200, 201), answer.text
        answered.append(answer.json()["id"])

    before = cluster.http.get("/v1/observations?limit=1000").json()["observations"]
    with robots(2, observe, cluster.http):
        for _ in range(2):
            time.sleep(2)
            versions.append(cluster.http.get("/v1/info").json()["memory_version"])
            (killed,) = cluster.processes("MemoryOwner")
            os.kill(killed, signal.SIGKILL)
            until_back(cluster, "MemoryOwner", killed, 1)
            wait_ready(cluster.http)
    assert len(answered) == sum(asked) == len(set(answered)), "something was done twice"
    kept = {each["id"] for each in cluster.http.get("/v1/observations?limit=1000").json()["observations"]}
    assert kept == set(answered) | {each["id"] for each in before}
    instances = cluster.http.get(f"/v1/categories/{learnt}/instances").json()["instances"]
    assert {each["source_id"] for each in instances if each["source"] == "observation"} >= set(answered)
    assert cluster.http.get("/v1/info").json()["memory_version"] > versions[-1] > versions[0]


def wait_ready(http: httpx.Client) -> None:
    """Returns once it is ready."""
    deadline = time.monotonic() + BACK_S
    while http.get("/readyz", timeout=BACK_S).status_code != 200:
        assert time.monotonic() < deadline
        time.sleep(0.1)


def test_all_of_it_killed_leaves_no_process_and_a_whole_memory(tmp_path: Any, look: Any, parts: Any) -> None:
    parts_of_it = ("Encoder", "PoseSolver", "MemoryOwner")
    with on_ray(tmp_path / "memory", tmp_path / "log") as first:
        seen = first.http.post("/v1/observations", files=parts(look())).json()["id"]
        replicas = [pid for part in parts_of_it for pid in first.processes(part)]
        assert len(replicas) == 5
        first.child.kill()
        deadline = time.monotonic() + BACK_S
        while any(os.path.exists(f"/proc/{pid}") for pid in replicas):
            assert time.monotonic() < deadline, "processes are left"
            time.sleep(0.1)
    with on_ray(tmp_path / "memory", tmp_path / "log") as again:
        assert again.http.get(f"/v1/observations/{seen}").status_code == 200

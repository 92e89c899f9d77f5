"""A connection that breaks after the service has done its work, before its answer came: nothing is learnt twice."""

from __future__ import annotations

from collections.abc import Iterator

import httpx
import pytest

from clients.datasets.folders import Sequence, load_burst
from clients.robot import RobotClient


class LosesAnswers(httpx.HTTPTransport):
    """Loses the first answer to each change."""

    def __init__(self) -> None:
        super().__init__()
        self.lost: list[str] = []

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        response = super().handle_request(request)
        what = f"{request.method} {request.url.path}"
        if request.method != "GET" and what not in self.lost:
            response.read()
            self.lost.append(what)
            raise httpx.ReadError("cut off", request=request)
        return response


@pytest.fixture
def transport() -> LosesAnswers:
    return LosesAnswers()


@pytest.fixture
def unlucky(url: str, transport: LosesAnswers, monkeypatch: pytest.MonkeyPatch) -> Iterator[RobotClient]:
    """A client whose every change is done, and then has to be asked for again."""
    monkeypatch.setattr("clients.robot.time.sleep", lambda seconds: None)
    with RobotClient(http=httpx.Client(transport=transport, base_url=url, timeout=60)) as robot:
        yield robot


def test_each_change_is_made_once(unlucky: RobotClient, transport: LosesAnswers, recordings: list[Sequence]) -> None:
    burst = load_burst(recordings[0], range(3))
    scan = unlucky.scan(burst)
    scan.add(burst.views[0])  # this answer is lost, those to the same path are not
    for view in burst.views[1:]:
        scan.add(view)
    assert scan.request.views == 3
    category = scan.complete("car")
    assert [each.id for each in unlucky.categories()] == [category.id]
    assert unlucky.observe(burst, category_id=category.id).category_id == category.id
    assert unlucky.category(category.id).instances == 2
    assert len(unlucky.observations()) == 1
    assert unlucky.rename(category.id, "auto").name == "auto"
    unlucky.forget(category.id)
    assert unlucky.categories() == []
    assert len(transport.lost) == 6

"""The robot client: the whole loop against a service, and what it makes of problems."""

from __future__ import annotations

import subprocess
import sys

import httpx
import numpy as np
import pytest

from clients import errors
from clients.answers.categories import Category
from clients.asynchronous import AsyncRobotClient
from clients.datasets.folders import Sequence, load_burst
from clients.exchange import Retry
from clients.robot import RobotClient
from clients.simulator.replay import ReplayWorld
from core.errors import InvalidInput, OneLookError
from core.views import Burst


def answering(handler: httpx.MockTransport) -> RobotClient:
    return RobotClient(http=httpx.Client(transport=handler, base_url="http://robot.test"), retry=Retry(attempts=1))


def test_a_novel_object_is_scanned_learnt_and_recognised(robot: RobotClient, recordings: list[Sequence]) -> None:
    burst = load_burst(recordings[0])
    seen = robot.observe(burst)
    assert seen.outcome == "novel"
    assert seen.pose is None
    assert seen.scan is not None
    for view in burst.views:
        seen.scan.add(view)
    category = seen.scan.complete("car")
    again = robot.observe(burst)
    assert (again.outcome, again.category_id, again.name) == ("known", category.id, "car")
    assert again.pose is not None
    np.testing.assert_allclose(again.pose.matrix, np.eye(4), atol=0.02)
    assert again.pose.world_from_object.shape == (4, 4)
    assert again.timings_ms["total"] > 0
    assert again.similarities[0].category_id == category.id


def test_a_pose_has_its_rectangle_in_each_view_and_nine_dimensions(robot: RobotClient, burst: Burst, learnt: Category) -> None:
    seen = robot.observe(burst, category_id=learnt.id, dof=9)
    assert seen.pose is not None
    told, stretched = seen.raw["pose"], seen.pose.target_from_object
    assert stretched is not None, seen.pose.not_9d_because
    np.testing.assert_allclose(stretched.as_matrix(), told["target_from_object"]["matrix"], atol=1e-9)
    np.testing.assert_allclose(stretched.rotation @ stretched.rotation.T, np.eye(3), atol=1e-9)
    for view, box_px in zip(burst.views, seen.pose.boxes_px, strict=True):
        assert view.camera is not None
        pixels, _ = view.camera.project(seen.pose.corners_m)
        assert box_px is not None
        height, width = view.size
        np.testing.assert_allclose(box_px[:2], np.clip(pixels.min(axis=0), 0, [width - 1, height - 1]), atol=1e-6)


def test_a_scan_asks_for_camera_poses_that_a_world_answers(robot: RobotClient, recordings: list[Sequence]) -> None:
    world = ReplayWorld(recordings[0])
    scan = robot.scan(load_burst(recordings[0], range(3)))
    for viewpoint in scan:
        scan.add(world.capture(viewpoint))
    category = scan.complete()
    assert category.views == len(scan) == 10
    assert category.name is None


def test_categories_are_listed_named_and_forgotten(robot: RobotClient, recordings: list[Sequence]) -> None:
    scan = robot.scan(load_burst(recordings[0], range(2)))
    for view in load_burst(recordings[0], range(2)).views:
        scan.add(view)
    category = scan.complete()
    assert robot.rename(category.id, "bug").name == "bug"
    assert [each.name for each in robot.categories()] == ["bug"]
    assert robot.info().categories == 1
    robot.forget(category.id)
    assert robot.categories() == []


def test_a_burst_can_travel_exactly(robot: RobotClient, recordings: list[Sequence]) -> None:
    burst = load_burst(recordings[0], range(2))
    seen = robot.observe(burst, exact=True, debug=True)
    assert seen.raw["views"] == 2
    assert robot.observation(seen.id).id == seen.id
    with pytest.raises(InvalidInput, match="frame"):
        robot.observe(burst, exact=True, frame="map")


def test_a_scan_can_be_taken_up_again_and_forgotten(robot: RobotClient, recordings: list[Sequence]) -> None:
    views = load_burst(recordings[0], range(2)).views
    begun = robot.scan(load_burst(recordings[0], range(2)))
    begun.add(views[0])
    again = robot.open_scan(begun.id)
    assert again.request.views == 1
    again.add(views[1])
    category = again.complete("bug")
    assert robot.category(category.id).name == "bug"
    robot.forget_scan(begun.id)
    with pytest.raises(errors.NotFoundProblem):
        robot.open_scan(begun.id)


def test_an_answer_is_corrected_and_scans_in_progress_are_listed(robot: RobotClient, recordings: list[Sequence]) -> None:
    burst = load_burst(recordings[0], range(2))
    seen = robot.observe(burst)
    assert seen.scan is not None
    assert [scan.id for scan in robot.scans()] == [seen.scan.id]
    corrected = robot.correct(seen.id, None, "bug")
    assert corrected.corrected_to is not None
    assert robot.category(corrected.corrected_to).name == "bug"


def test_pictures_are_png(robot: RobotClient, recordings: list[Sequence]) -> None:
    seen = robot.observe(load_burst(recordings[0], range(2)))
    assert robot.picture(f"/v1/observations/{seen.id}/foreground.png", view=1).startswith(b"\x89PNG")


@pytest.mark.parametrize(("name", "kind"), [(urn.removeprefix(errors.PROBLEM_URN), kind) for urn, kind in errors.PROBLEMS.items()])
def test_every_problem_type_has_its_exception(name: str, kind: type[errors.ServiceProblem]) -> None:
    problem = {"type": f"urn:onelook:problem:{name}", "title": "Title", "status": 422, "detail": "what to do", "field": "views[1].K"}
    response = httpx.Response(422, json=problem, headers={"content-type": "application/problem+json"})
    robot = answering(httpx.MockTransport(lambda request: response))
    with pytest.raises(kind, match="^what to do$") as caught:
        robot.categories()
    assert type(caught.value) is kind
    assert (caught.value.status, caught.value.field) == (422, "views[1].K")


def test_the_service_names_problems_as_the_client_does() -> None:
    from service.errors import KINDS, problem_of

    unexpected = problem_of(OneLookError("of no kind that has a status")).type
    assert {f"{errors.PROBLEM_URN}{name}" for _, _, name, _ in KINDS} | {unexpected} == set(errors.PROBLEMS)


def test_a_wrong_field_of_a_real_burst_is_named(robot: RobotClient, recordings: list[Sequence]) -> None:
    with pytest.raises(errors.InvalidInputProblem, match="views_used"):
        robot.observe(load_burst(recordings[0], range(2)), views_used=3)
    with pytest.raises(errors.NotFoundProblem):
        robot.observe(load_burst(recordings[0], range(2)), category_id="nobody")


def test_another_server_is_told_from_the_service() -> None:
    robot = answering(httpx.MockTransport(lambda request: httpx.Response(502, text="<html>Bad Gateway</html>")))
    with pytest.raises(errors.ServiceProblem, match="502 Bad Gateway, which is no answer of this service"):
        robot.info()


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (httpx.Response(200, html="<html>somebody's page</html>"), "200 OK"),
        (httpx.Response(302, headers={"location": "/login"}), "302 Found"),
    ],
)
def test_a_page_or_a_redirection_is_no_answer(answer: httpx.Response, said: str) -> None:
    robot = answering(httpx.MockTransport(lambda request: answer))
    for ask in (robot.categories, lambda: robot.cloud("c"), lambda: next(robot.events())):
        with pytest.raises(errors.ServiceProblem, match=f"{said}, which is no answer of this service"):
            ask()


@pytest.mark.parametrize(
    "url", ["127.0.0.1:8000", "localhost:8000", "http://robot:port", "http://::1:8000", "ftp://robot", "http://a..b", "http://", ""]
)
@pytest.mark.parametrize("client", [RobotClient, AsyncRobotClient])
def test_what_is_no_address_is_said_at_once(client: type, url: str) -> None:
    with pytest.raises(InvalidInput, match=r"^url: expected an address such as http://127\.0\.0\.1:8000 .*found '"):
        client(url)


@pytest.mark.parametrize(
    ("failure", "kind", "words"),
    [
        (httpx.ConnectError("refused"), errors.Unreachable, "onelook serve"),
        (httpx.ReadTimeout("late"), errors.TooSlow, "did not answer GET /v1/info in time"),
        (httpx.RemoteProtocolError("cut off"), errors.Unreachable, "cut off"),
    ],
)
def test_failures_on_the_way_say_what_to_do(failure: Exception, kind: type[errors.ClientError], words: str) -> None:
    def fail(request: httpx.Request) -> httpx.Response:
        raise failure

    with pytest.raises(kind, match=words):
        answering(httpx.MockTransport(fail)).info()


def test_the_client_loads_without_the_service_and_its_libraries() -> None:
    heavy = {"torch", "open3d", "fastapi", "transformers", "scipy", "cv2", "PIL", "pydantic", "typer"}
    check = f"import sys, clients.robot; sys.exit(str({heavy!r} & set(sys.modules) or ''))"
    done = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True)
    assert done.stderr.strip() == ""

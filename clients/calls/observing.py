"""Observations."""

from __future__ import annotations

from typing import Any, Literal

from clients.answers.observations import Observation, Outcome
from clients.answers.scans import ScanRequest
from clients.calls.call import Call, Direction, burst_body, given, reading, reading_list
from core.views import Burst


def observe(
    burst: Burst,
    *,
    frame: str | None = None,
    learn: bool = True,
    category_id: str | None = None,
    threshold: float | None = None,
    false_known_rate: float | None = None,
    looks: int | None = None,
    views_used: int | None = None,
    up: Direction | None = None,
    variant: str | None = None,
    dof: Literal[7, 9] | None = None,
    dims: int | None = None,
    method: str | None = None,
    consensus_deg: float | None = None,
    inlier_ratio: float | None = None,
    estimator: str | None = None,
    alternatives: int | None = None,
    seed: int | None = None,
    debug: bool = False,
    exact: bool = False,
) -> Call[Observation[ScanRequest]]:
    """What `burst` shows: a known object with its pose, or a novel one with a scan to carry out.

    Args:
        frame: name of the burst's world frame, given back as it came.
        learn: whether a known object's burst joins its category.
        category_id: takes the object for one of this category, and skips the decision.
        threshold: least similarity of a known object, in place of one from a rate.
        false_known_rate: of objects of no known category, the share that may be called known.
        looks: views in the burst that were taken since the object was uncertain; with each there is less room for doubt.
        views_used: only the first so many views.
        up: away from the support, in the world frame, for the scan of a novel object; told from the cameras where None.
        variant, dof, dims, method, consensus_deg, inlier_ratio, estimator, alternatives, seed: of the pose pipeline (docs/method.md).
        debug: adds to `raw` what the pose was computed from.
        exact: sends every pixel as it is, in one npz file many times larger, instead of colour as JPEG and depth in millimetres.
    """
    params = given(
        learn=learn,
        category_id=category_id,
        threshold=threshold,
        false_known_rate=false_known_rate,
        looks=looks,
        views_used=views_used,
        up=None if up is None else list(up),
        variant=variant,
        dof=dof,
        dims=dims,
        method=method,
        consensus_deg=consensus_deg,
        inlier_ratio=inlier_ratio,
        estimator=estimator,
        alternatives=alternatives,
        seed=seed,
        include="debug" if debug else None,
    )
    return Call("POST", "/v1/observations", reading(Observation.from_json), params, burst_body(burst, frame, exact))


def observation(observation_id: str, *, debug: bool = False) -> Call[Observation[ScanRequest]]:
    """An earlier observation, as it was answered then."""
    params = given(include="debug" if debug else None)
    return Call("GET", f"/v1/observations/{observation_id}", reading(Observation.from_json), params)


def observations(
    limit: int = 50, *, before: str | None = None, category_id: str | None = None, outcome: Outcome | None = None
) -> Call[list[Observation[ScanRequest]]]:
    """The latest observations, newest first: older than the observation `before`, and only those decided so."""
    params = given(limit=limit, before=before, category_id=category_id, outcome=outcome)
    return Call("GET", "/v1/observations", reading_list("observations", Observation.from_json), params)


def correct(observation_id: str, category_id: str | None, name: str | None = None) -> Call[Observation[ScanRequest]]:
    """Says what an observation was really of: its burst joins that category, and leaves the one it had joined.

    Args:
        category_id: the right category; None makes a new one of the observation's own views.
        name: of the new category.
    """
    said = given(name=name) | {"category_id": category_id}
    return Call("POST", f"/v1/observations/{observation_id}/correct", reading(Observation.from_json), body={"json": said})


def detections(observation_id: str) -> Call[dict[str, Any]]:
    """An earlier observation in the shape of ROS 2's vision_msgs/msg/Detection3DArray, as JSON."""
    return Call("GET", f"/v1/observations/{observation_id}", reading(dict), {"format": "vision_msgs"})


def picture(path: str, **params: str | int) -> Call[bytes]:
    """A picture's PNG by its path, as `/v1/observations/{id}/overlay.png`; `params` are its query's, as `view=2`."""
    return Call("GET", path, lambda response: response.content, params)

"""The pictures of an encounter, fetched from the service and made small enough to stand in a page."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from clients.errors import NotFoundProblem
from clients.robot import RobotClient
from clients.simulator.encounter import Encounter

JPEG_QUALITY = 82
THUMBNAIL_SIDE = 128
THUMBNAIL_COLUMNS = 5
Image = NDArray[Any]
"""Blue, green, red, shape (H, W, 3)."""
CROP_SIDE = 320
"""Pixels a side of the pictures of one view; a browser shows them no larger."""


@dataclass(frozen=True)
class Pictures:
    """Data URIs of one encounter's pictures; None where there is none."""

    view: int
    """Index in the burst of the view that they show."""
    rgb: str | None
    foreground: str | None
    pca: str | None
    overlay: str | None
    correspondences: str | None
    scanned: str | None
    """The views that a category was learnt from."""
    waypoints: tuple[str | None, ...]
    """Of each waypoint the view there, with the box where it has a pose."""


def fetch_pictures(robot: RobotClient, encounter: Encounter) -> Pictures:
    """All pictures that the service has of an encounter."""
    view = encounter.best_view

    def fetch(name: str, side: int | None = None, *, of: str = encounter.observation_id, **which: int) -> str | None:
        if not of:
            return None
        try:
            return data_uri(robot.picture(f"/v1/observations/{of}/{name}.png", **which), side)
        except NotFoundProblem:
            return None

    return Pictures(
        view=view,
        rgb=fetch("rgb", CROP_SIDE, view=view),
        foreground=fetch("foreground", CROP_SIDE, view=view),
        pca=fetch("pca", CROP_SIDE, view=view),
        overlay=fetch("overlay", CROP_SIDE, view=view),
        correspondences=fetch("correspondences", view=view),
        scanned=_scanned(robot, encounter),
        waypoints=tuple(fetch("overlay", CROP_SIDE, of=each.observation_id, view=0) for each in encounter.waypoints),
    )


def data_uri(png: bytes, side: int | None = None) -> str:
    """A PNG as an inline JPEG, reduced to at most `side` pixels high."""
    image = _decode(png)
    if side is not None and image.shape[0] > side:
        image = _resized(image, side)
    return _jpeg_uri(image)


def _scanned(robot: RobotClient, encounter: Encounter) -> str | None:
    if encounter.learnt is None:
        return None
    folder = f"/v1/categories/{encounter.learnt}/views"
    try:
        pictures = [robot.picture(f"{folder}/{view}/rgb.png") for view in range(encounter.learnt_views)]
    except NotFoundProblem:  # somebody deleted the category since
        return None
    thumbnails = [_resized(_decode(picture), THUMBNAIL_SIDE) for picture in pictures]
    missing = -len(thumbnails) % THUMBNAIL_COLUMNS
    thumbnails += [np.zeros_like(thumbnails[0])] * missing
    rows = [np.hstack(thumbnails[start : start + THUMBNAIL_COLUMNS]) for start in range(0, len(thumbnails), THUMBNAIL_COLUMNS)]
    return _jpeg_uri(np.vstack(rows))


def _decode(png: bytes) -> Image:
    return np.asarray(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR))


def _resized(image: Image, height: int) -> Image:
    return np.asarray(cv2.resize(image, (round(image.shape[1] * height / image.shape[0]), height), interpolation=cv2.INTER_AREA))


def _jpeg_uri(image: Image) -> str:
    _, encoded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return "data:image/jpeg;base64," + base64.b64encode(bytes(encoded)).decode()

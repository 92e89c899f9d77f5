"""Whatever numbers, arrays and JSON somebody sends: an answer, or a problem that names a field; never a 500."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tests.service.conftest import as_text

few = settings(max_examples=60, suppress_health_check=list(HealthCheck))
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=10), inner, max_size=5),
    max_leaves=20,
)
NUMBERS = st.floats() | st.integers(-(2**70), 2**70) | st.sampled_from([0, 1, -1, 1e-320, 1e308])
CAMERA = st.fixed_dictionaries({}, optional={"K": st.lists(NUMBERS, min_size=9, max_size=9), "world_from_camera": JSON})
KINDS = hnp.scalar_dtypes() | hnp.unicode_string_dtypes() | hnp.byte_string_dtypes()
SHAPES = hnp.array_shapes(max_dims=5, max_side=12)


def require_answered(answer):
    assert answer.status_code in {201, 422}, answer.text[:500]
    if answer.status_code == 422:
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.json().get("field")
        assert "Traceback" not in answer.text


@pytest.fixture(scope="module")
def burst(look):
    return look(views=2)


def sent(client, parts, burst, content):
    files = parts(burst)
    files[0] = ("burst", ("burst.json", content, "application/json"))
    return client.post("/v1/observations", files=files)


@few
@given(about=JSON)
def test_any_json_part(client, parts, burst, about):
    require_answered(sent(client, parts, burst, json.dumps(about).encode()))


@few
@given(views=st.lists(CAMERA, min_size=2, max_size=2), scale=NUMBERS)
def test_any_numbers_of_a_camera(client, parts, burst, views, scale):
    require_answered(sent(client, parts, burst, json.dumps({"views": views, "depth_scale": scale}).encode()))


@few
@given(
    rotation=hnp.arrays(float, (3, 3), elements=st.floats(-1.1, 1.1)),
    at=hnp.arrays(float, 3, elements=st.floats(allow_nan=False, allow_infinity=False)),
    focal=st.floats(1e-3, 1e6),
)
def test_any_pose_that_is_nearly_a_rotation(client, npz, burst, rotation, at, focal):
    poses = np.tile(np.eye(4), (2, 1, 1))
    left, _, right = np.linalg.svd(rotation)
    poses[:, :3, :3], poses[:, :3, 3] = left @ right, at
    K = np.array([[focal, 0, 80], [0, focal, 80], [0, 0, 1]])
    body = npz(burst, world_from_camera=poses, K=K)
    require_answered(client.post("/v1/observations", content=body, headers={"content-type": "application/x-npz"}))


@few
@given(depth=hnp.arrays(np.float32, (2, 8, 8), elements=st.floats(width=32)), tile=st.booleans())
def test_any_depth(client, npz, burst, depth, tile):
    whole = np.tile(depth, (1, 20, 20)) if tile else np.stack([view.depth_m for view in burst.views])
    whole[:, :8, :8] = depth
    body = npz(burst, depth_m=whole)
    require_answered(client.post("/v1/observations", content=body, headers={"content-type": "application/x-npz"}))


@few
@given(name=st.sampled_from(["rgb", "depth_m", "K", "world_from_camera", "mask"]), kind=KINDS, shape=SHAPES, data=st.data())
def test_any_array(client, npz, burst, name, kind, shape, data):
    array = np.broadcast_to(data.draw(hnp.arrays(kind, 1)), shape)
    if array.dtype.hasobject:
        return
    body = npz(burst, **{name: array})
    require_answered(client.post("/v1/observations", content=body, headers={"content-type": "application/x-npz"}))


@few
@given(cut=st.floats(0, 1), put=st.binary(max_size=8))
def test_any_npz_that_is_cut_and_patched(client, npz, burst, cut, put):
    whole = npz(burst)
    where = int(cut * len(whole))
    for body in (whole[:where], whole[:where] + put + whole[where + len(put) :]):
        require_answered(client.post("/v1/observations", content=body, headers={"content-type": "application/x-npz"}))


def test_an_empty_zip_is_no_burst(client):
    empty = io.BytesIO()
    np.savez(empty)
    require_answered(client.post("/v1/observations", content=empty.getvalue(), headers={"content-type": "application/x-npz"}))


@few
@given(
    message=JSON | st.dictionaries(st.sampled_from(["type", "category_id", "window", "variant", "weight", "seed"]), JSON | st.just("hello"))
)
def test_any_first_message_of_a_followed_object(client, message):
    with client.websocket_connect("/v1/track") as followed:
        followed.send_text(json.dumps(message))
        assert followed.receive_json()["type"] in {"problem", "ready"}


@few
@given(
    changes=st.dictionaries(
        st.sampled_from(["id", "K", "world_from_camera", "depth_scale", "time_s", "rgb", "depth", "mask"]), JSON | NUMBERS, min_size=1
    )
)
def test_any_frame_of_a_followed_object(client, burst, changes):
    view = burst.views[0]
    frame = {
        "type": "frame",
        "id": 1,
        "K": view.camera.K.tolist(),
        "world_from_camera": view.camera.world_from_camera.tolist(),
        "rgb": as_text(view.rgb[..., ::-1]),
        "depth": as_text(np.round(view.depth_m * 1000).astype(np.uint16)),
    }
    with client.websocket_connect("/v1/track") as followed:
        followed.send_text('{"type": "hello"}')
        assert followed.receive_json()["type"] == "ready"
        followed.send_text(json.dumps(frame | changes))
        assert followed.receive_json()["type"] in {"problem", "pose"}
        followed.send_text(json.dumps(frame | {"id": 2, "time_s": 1e308}))
        answer = followed.receive_json()
        assert (answer["type"], answer["frame_id"]) in {("pose", 2), ("problem", 2)}

"""Every wrong input is answered with a problem that names the field and says what to do."""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib

import cv2
import numpy as np
import pytest

from core.views import Burst
from tests.service.problems import refused


def huge_png(width=10_000, height=10_000):
    """100 megapixels in a few hundred bytes: the header is honest, the pixels are not there."""
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(b"\0" * 1000)), (b"IEND", b"")]
    body = b"".join(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks)
    return b"\x89PNG\r\n\x1a\n" + body


def put(name, index, content):
    """An edit that replaces one file."""

    def edit(about, files):
        while len(files[name]) <= index:
            files[name].append(files["depth"][0])
        files[name][index] = content

    return edit


def say(**changes):
    """An edit of the JSON part."""
    return lambda about, files: about.update(changes)


def view(index, **changes):
    """An edit of one view of the JSON part; None leaves a field out."""

    def edit(about, files):
        about["views"][index] |= changes
        about["views"][index] = {name: value for name, value in about["views"][index].items() if value is not None}

    return edit


def flip_hand(about, files):
    for row in about["views"][1]["world_from_camera"]:
        row[0] = -row[0]


def scale_pose(about, files):
    about["views"][1]["world_from_camera"][0] = [10 * value for value in about["views"][1]["world_from_camera"][0]]


def drop(name):
    return lambda about, files: files[name].pop()


def no_cameras(about, files):
    del about["views"]


def zero_depth(about, files):
    files["depth"][1] = png16(np.zeros((160, 160)))


def small_depth(about, files):
    files["depth"][1] = png16(np.full((80, 80), 5000))


def png16(values):
    return cv2.imencode(".png", values.astype(np.uint16))[1].tobytes()


def png8(*shape):
    return cv2.imencode(".png", np.zeros(shape, dtype=np.uint8))[1].tobytes()


def empty_mask(about, files):
    files["mask"] = [png8(160, 160) for _ in files["rgb"]]


CASES = {
    "GIF for colour": (put("rgb", 2, b"GIF89a" + b"\0" * 50), "views[2].rgb", ["is a GIF file", "send a JPEG or PNG"]),
    "text for colour": (put("rgb", 0, b"hello"), "views[0].rgb", ["is not an image", "JPEG or PNG"]),
    "empty colour file": (put("rgb", 1, b""), "views[1].rgb", ["is empty"]),
    "depth sent as colour": (put("rgb", 1, png16(np.full((160, 160), 5000))), "views[1].rgb", ["16-bit grey", "as depth is"]),
    "JPEG cut short": (put("rgb", 0, b"\xff\xd8\xff\xe0" + b"\0" * 40), "views[0].rgb", ["broken JPEG"]),
    "100 megapixels": (put("rgb", 3, huge_png()), "views[3].rgb", ["10000×10000", "at most 16 megapixels"]),
    "tiny image": (put("rgb", 0, png8(8, 8, 3)), "views[0].rgb", ["8×8 pixels"]),
    "8-bit depth": (put("depth", 1, png8(160, 160)), "views[1].depth", ["PNG of 8 bits and 1 channel", "16-bit PNG"]),
    "JPEG depth": (put("depth", 0, b"\xff\xd8\xff\xe0"), "views[0].depth", ["is a JPEG file", "16-bit PNG"]),
    "depth all zero": (zero_depth, "views[1].depth", ["zero everywhere"]),
    "depth of another size": (small_depth, "views[1].depth", ["160×160"]),
    "millimetres as metres": (say(depth_scale=1.0), "views[0].depth", ["millimetres sent as metres", "depth_scale"]),
    "depth far too small": (say(depth_scale=1e-6), "views[0].depth", ["depth_scale"]),
    "negative depth_scale": (say(depth_scale=-1), "burst.depth_scale", ["greater than 0"]),
    "empty mask": (empty_mask, "views[0].mask", ["is empty", "leave it out"]),
    "fewer depth images": (drop("depth"), "depth", ["5 entries for 6 rgb images"]),
    "fewer colour images": (drop("rgb"), "depth", ["6 entries for 5 rgb images"]),
    "no cameras with depth": (no_cameras, "views[0].K", ["is missing", "depth is given"]),
    "one view without K": (view(3, K=None), "views[3].K", ["is missing", "every view"]),
    "one view without pose": (view(2, world_from_camera=None), "views[2].world_from_camera", ["is missing"]),
    "K of 8 numbers": (view(4, K=[1.0] * 8), "views[4].K", ["expected 3×3 finite numbers", "9 row by row"]),
    "views that are no list": (say(views={}), "views", ["array"]),
    "K of words": (view(0, K="focal"), "views[0].K", ["expected 3×3"]),
    "K of another resolution": (view(0, K=[600.0, 0, 320, 0, 600, 240, 0, 0, 1]), "views[0].K", ["principal point", "160×160"]),
    "left-handed pose": (flip_hand, "views[1].world_from_camera", ["left-handed", "OpenCV"]),
    "pose with scale": (scale_pose, "views[1].world_from_camera", ["not a rotation"]),
    "unknown JSON field": (say(depthscale=0.001), "burst.depthscale", ["not permitted"]),
}


@pytest.mark.parametrize("case", CASES)
def test_a_wrong_part_is_named(client, look, parts, case):
    edit, field, words = CASES[case]
    refused(client.post("/v1/observations", files=parts(look(), edit)), 422, field, *words)


def test_malformed_json(client, look, parts):
    files = parts(look())
    files[0] = ("burst", ("burst.json", b'{"views": [', "application/json"))
    refused(client.post("/v1/observations", files=files), 422, "burst", "is not JSON", "depth_scale")


def test_a_missing_json_part(client, look, parts):
    refused(client.post("/v1/observations", files=parts(look())[1:]), 422, "burst", "0 times", "one JSON part")


def test_no_images(client):
    files = [("burst", ("burst.json", b"{}", "application/json"))]
    refused(client.post("/v1/observations", files=files), 422, "rgb", "has 0 images", "1 to 12 views")


def test_too_many_views(client, look, parts):
    burst = look()
    refused(client.post("/v1/observations", files=parts(Burst(burst.views * 3))), 422, "rgb", "has 18 images", "1 to 12 views")


def test_an_unexpected_part(client, look, parts):
    files = [*parts(look()), ("image", ("a.png", b"", "image/png"))]
    refused(client.post("/v1/observations", files=files), 422, "image", "the parts are burst, rgb, depth, mask")


def test_images_sent_as_text(client):
    refused(client.post("/v1/observations", files={"burst": (None, "{}"), "rgb": (None, "/tmp/a.jpg")}), 422, "rgb", "send it as a file")


def test_a_body_without_a_boundary(client):
    answer = client.post("/v1/observations", content=b"x", headers={"content-type": "multipart/form-data"})
    refused(answer, 422, "body", "boundary")


def test_another_media_type(client):
    answer = client.post("/v1/observations", content=b"{}", headers={"content-type": "application/json"})
    refused(answer, 415, None, "is application/json", "multipart/form-data")


def test_a_body_beyond_the_limit(client):
    answer = client.post("/v1/observations", content=b"\0" * 8_000_001, headers={"content-type": "application/x-npz"})
    refused(answer, 413, None, "more than 8 MB", "ONELOOK_MAX_UPLOAD_MB")


@pytest.mark.parametrize("query", ["threshold=high", "views_used=0", "seed=-1", "include=everything", "vews_used=2"])
def test_a_wrong_option(client, look, parts, query):
    refused(client.post(f"/v1/observations?{query}", files=parts(look())), 422, query.partition("=")[0].replace("include", "include[0]"))


def test_more_views_used_than_sent(client, look, parts):
    refused(client.post("/v1/observations?views_used=9", files=parts(look())), 422, "views_used", "the burst has 6 views")


def test_an_unknown_variant(client, look, parts):
    refused(client.post("/v1/observations?variant=nonsense", files=parts(look())), 422, "variant", "'nonsense' is none of", "ucd")


def test_an_unknown_category(client, look, parts):
    refused(client.post("/v1/observations?category_id=nope", files=parts(look())), 404, None, "'nope'", "GET /v1/categories")


def test_nothing_to_see(client, look, parts):
    def black(about, files):
        files["rgb"] = [png8(160, 160, 3) for _ in files["rgb"]]

    answer = client.post("/v1/observations", files=parts(look(), black))
    refused(answer, 422, "views", "stands out from its background")
    assert answer.json()["type"] == "urn:onelook:problem:no-object"


NPZ_CASES = {
    "no rgb": ({"rgb": None}, "rgb", ["is missing", "uint8"]),
    "float rgb": ({"rgb": np.zeros((6, 160, 160, 3))}, "views[0].rgb", ["uint8", "float64"]),
    "NaN depth": ({"depth_m": np.full((6, 160, 160), np.nan)}, "views[0].depth", ["NaN", "send 0"]),
    "infinite depth": ({"depth_m": np.full((6, 160, 160), 1e300)}, "views[0].depth", ["infinite"]),
    "millimetres": ({"depth_m": np.full((6, 160, 160), 812.0)}, "views[0].depth", ["millimetres sent as metres"]),
    "five poses": ({"world_from_camera": np.stack([np.eye(4)] * 5)}, "world_from_camera", ["5 entries for 6"]),
    "K of another shape": ({"K": np.zeros((6, 4, 4))}, "views[0].K", ["expected shape (3, 3)"]),
    "an unknown array": ({"depth": np.zeros((6, 160, 160))}, "depth", ["not expected", "depth_m"]),
    "no cameras": ({"K": None, "world_from_camera": None}, "views[0].K", ["is missing", "depth is given"]),
    "one dimension": ({"rgb": np.zeros(5, np.uint8)}, "rgb", ["4 dimensions"]),
}


@pytest.mark.parametrize("case", NPZ_CASES)
def test_a_wrong_array_is_named(client, look, npz, case):
    changes, field, words = NPZ_CASES[case]
    answer = client.post("/v1/observations", content=npz(look(), **changes), headers={"content-type": "application/x-npz"})
    refused(answer, 422, field, *words)


def post_npz(client, body):
    return client.post("/v1/observations", content=body, headers={"content-type": "application/x-npz"})


def test_pickled_objects_are_never_loaded(client):
    buffer = io.BytesIO()
    np.savez(buffer, rgb=np.array([{"a": 1}], dtype=object))
    refused(post_npz(client, buffer.getvalue()), 422, "rgb", "never pickled")


def test_no_npz_at_all(client):
    refused(post_npz(client, b"hello"), 422, "body", "not a readable npz file", "numpy.savez")


def test_an_array_that_claims_to_be_huge_is_refused_before_it_is_read(client):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "|u1", "fortran_order": False, "shape": (10, 100_000, 100_000, 3)})
    body = io.BytesIO()
    with zipfile.ZipFile(body, "w") as archive:
        archive.writestr("rgb.npy", header.getvalue())
    refused(post_npz(client, body.getvalue()), 422, "rgb", "megapixels")


def test_an_array_shorter_than_its_header_says(client):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "|u1", "fortran_order": False, "shape": (1, 64, 64, 3)})
    body = io.BytesIO()
    with zipfile.ZipFile(body, "w") as archive:
        archive.writestr("rgb.npy", header.getvalue() + b"\0" * 10)
    refused(post_npz(client, body.getvalue()), 422, "rgb", "cannot be read")


def test_json_bodies_are_checked_too(client, ball):
    refused(client.patch(f"/v1/categories/{ball['id']}", json={"name": ""}), 422, "name", "at least 1 character")
    refused(
        client.patch(f"/v1/categories/{ball['id']}", content=b"{", headers={"content-type": "application/json"}),
        422,
        "body",
        "is not JSON",
    )
    refused(client.post("/v1/scans", json={"observation": "x"}), 422, "observation_id", "required")
    refused(client.post("/v1/scans", content=json.dumps([1]), headers={"content-type": "application/json"}), 422, "body")

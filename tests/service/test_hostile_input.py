"""Input that is meant to break the service, or that a broken robot sends: bounded, told apart, and never a 500."""

from __future__ import annotations

import io
import struct
import time
import tracemalloc
import zipfile
import zlib

import cv2
import numpy as np
import pytest
from PIL import Image

from core.views import Burst

NPZ = {"content-type": "application/x-npz"}
JSON = {"content-type": "application/json"}
DEEP = b"[" * 200_000
LONG_NUMBER = b"9" * 10_000


def refused(answer, status, field, *words):
    """Asserts a problem about `field` whose detail has all `words`."""
    problem = answer.json()
    assert (answer.status_code, problem.get("field")) == (status, field), answer.text[:500]
    assert answer.headers["content-type"] == "application/problem+json"
    assert "Traceback" not in answer.text
    for word in words:
        assert word in problem["detail"], problem["detail"]


def encoded(image, kind, **options):
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


def replaced(name, make):
    """An edit that replaces each file by what is made of its pixels."""

    def edit(about, files):
        files[name] = [make(cv2.imdecode(np.frombuffer(each, np.uint8), cv2.IMREAD_UNCHANGED)) for each in files[name]]

    return edit


def as_image(bgr):
    return Image.fromarray(bgr[..., ::-1])


def png_of(chunks):
    body = b"".join(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks)
    return b"\x89PNG\r\n\x1a\n" + body


FORMS = {
    "16-bit RGB": lambda bgr: cv2.imencode(".png", bgr.astype(np.uint16) * 257)[1].tobytes(),
    "RGBA": lambda bgr: encoded(as_image(bgr).convert("RGBA"), "PNG"),
    "palette": lambda bgr: encoded(as_image(bgr).quantize(256), "PNG"),
    "CMYK JPEG": lambda bgr: encoded(as_image(bgr).convert("CMYK"), "JPEG", quality=95),
    "progressive JPEG": lambda bgr: encoded(as_image(bgr), "JPEG", quality=95, progressive=True),
    "JPEG with EXIF rotation": lambda bgr: encoded(as_image(bgr), "JPEG", quality=95, exif=turned_by(6)),
}


def turned_by(orientation):
    exif = Image.Exif()
    exif[0x0112] = orientation
    return exif


@pytest.mark.parametrize("form", FORMS)
def test_unusual_forms_of_an_image_are_the_same_image(client, look, parts, learn, form):
    category = learn()
    answer = client.post("/v1/observations?learn=false", files=parts(look(views=4), replaced("rgb", FORMS[form])))
    assert (answer.status_code, answer.json()["category_id"]) == (201, category["id"])
    straight = client.post("/v1/observations?learn=false", files=parts(look(views=4))).json()["pose"]["target_from_reference"]
    np.testing.assert_allclose(answer.json()["pose"]["target_from_reference"]["translation_m"], straight["translation_m"], atol=0.01)


def test_one_bit_and_grey_images_are_images(client, look, parts):
    for mode in ("1", "L", "LA"):
        change = replaced("rgb", lambda bgr, mode=mode: encoded(as_image(bgr).convert(mode), "PNG"))
        assert client.post("/v1/observations", files=parts(look(), change)).status_code == 201


def test_exif_turns_an_image_that_comes_alone(client, look, parts):
    """One with a camera or depth stays as its pixels are stored, which K and depth are of."""

    def alone(about, files):
        del about["views"], files["depth"][:]
        replaced("rgb", lambda bgr: encoded(as_image(bgr[:80]), "JPEG", exif=turned_by(6)))(about, files)

    seen = client.post("/v1/observations", files=parts(look(), alone)).json()
    shown = Image.open(io.BytesIO(client.get(f"/v1/observations/{seen['id']}/rgb.png").content))
    assert shown.size == (80, 160)


BOMBS = {
    "text that unpacks to 100 MB": png_of(
        [
            (b"IHDR", struct.pack(">IIBBBBB", 64, 64, 8, 2, 0, 0, 0)),
            *[(b"zTXt", b"a\0\0" + zlib.compress(bytes(10_000_000)))] * 10,
            (b"IDAT", zlib.compress(bytes(64 * (64 * 3 + 1)))),
            (b"IEND", b""),
        ]
    ),
    "pixels that unpack to far more than the size says": png_of(
        [
            (b"IHDR", struct.pack(">IIBBBBB", 64, 64, 8, 2, 0, 0, 0)),
            (b"IDAT", zlib.compress(bytes(200_000_000))),
            (b"IEND", b""),
        ]
    ),
    "a JPEG of a thousand scans": b"\xff\xd8\xff\xe0" + b"\xff\xda\0\x0c" * 1000,
    "no pixels": png_of([(b"IHDR", struct.pack(">IIBBBBB", 0, 0, 8, 2, 0, 0, 0)), (b"IEND", b"")]),
    "four thousand million pixels a side": png_of(
        [(b"IHDR", struct.pack(">IIBBBBB", 2**32 - 1, 2**32 - 1, 8, 2, 0, 0, 0)), (b"IEND", b"")]
    ),
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_image_bombs_take_neither_memory_nor_time(client, look, parts, bomb):
    files = parts(look(), lambda about, files: files["rgb"].__setitem__(1, BOMBS[bomb]))
    tracemalloc.start()
    started = time.monotonic()
    answer = client.post("/v1/observations", files=files)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert answer.status_code in {201, 422}, answer.text
    assert peak < 60_000_000
    assert time.monotonic() - started < 20


def npz_of(entries, compression=zipfile.ZIP_DEFLATED):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, array in entries:
            stream = io.BytesIO()
            np.lib.format.write_array_header_1_0(stream, np.lib.format.header_data_from_array_1_0(array))
            content = array.tobytes() if array.strides[0] else bytes(1000)  # what only says that it is large
            archive.writestr(name, stream.getvalue() + content)
    return buffer.getvalue()


def test_zip_bombs_are_refused_by_what_they_say(client, settings):
    black = np.broadcast_to(np.uint8(0), (12, 3000, 4000, 3))
    refused(client.post("/v1/observations", content=npz_of([("rgb.npy", black)]), headers=NPZ), 422, "rgb", "ONELOOK_MAX_MEGAPIXELS")
    small, wide = np.zeros((1, 64, 64, 3), np.uint8), np.broadcast_to(0.0, (1, 64, 200_000))
    for name in ("depth_m", "mask"):
        body = npz_of([("rgb.npy", small), (f"{name}.npy", wide)])
        refused(client.post("/v1/observations", content=body, headers=NPZ), 422, name, "fits no 64×64 images")
    body = npz_of([("rgb.npy", small), ("K.npy", np.broadcast_to(0.0, (1, 3, 10_000_000)))])
    refused(client.post("/v1/observations", content=body, headers=NPZ), 422, "K", "(3, 3) or (V, 3, 3)")


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_array_that_comes_again_and_again_is_refused(client):
    body = npz_of([("rgb.npy", np.zeros((1, 64, 64, 3), np.uint8))] * 50)
    refused(client.post("/v1/observations", content=body, headers=NPZ), 422, "body", "50 arrays")


DEPTHS = {
    "denormal numbers": (lambda depth: np.full_like(depth, 1e-40), "views[0].depth", "depth_scale"),
    "minus infinity": (lambda depth: np.where(depth > 0, -np.inf, 0), "views[0].depth", "NaN or infinite"),
    "negative": (lambda depth: -depth, "views[0].depth", "negative"),
    "huge": (lambda depth: np.where(depth > 0, 3e38, 0), "views[0].depth", "millimetres sent as metres"),
}


@pytest.mark.parametrize("case", DEPTHS)
def test_depth_that_no_camera_measures(client, look, npz, case):
    change, field, word = DEPTHS[case]
    burst = look()
    depth = np.stack([change(view.depth_m) for view in burst.views]).astype(np.float32)
    refused(client.post("/v1/observations", content=npz(burst, depth_m=depth), headers=NPZ), 422, field, word)


def test_a_few_denormal_depths_are_taken_for_not_measured(client, look, npz, learn):
    category, burst = learn(), look(views=4)
    depth = np.stack([view.depth_m for view in burst.views])
    depth[:, ::7, ::7] = np.where(depth[:, ::7, ::7] > 0, np.float32(1e-40), 0)
    answer = client.post("/v1/observations", content=npz(burst, depth_m=depth), headers=NPZ).json()
    assert (answer["outcome"], answer["category_id"]) == ("known", category["id"])
    assert answer["pose"]["target_from_reference"]["scale"] == pytest.approx(1, abs=0.05)


def test_saturated_depth(client, look, parts):
    full = replaced("depth", lambda depth: cv2.imencode(".png", np.where(depth > 0, 65535, 0).astype(np.uint16))[1].tobytes())
    refused(client.post("/v1/observations", files=parts(look(), full)), 422, "depth[0]", "100% of what it measured is 65535", "send 0")


def edited(**changes):
    """An edit of every view's camera by functions of the matrices."""

    def edit(about, files):
        for view in about["views"]:
            for name, change in changes.items():
                view[name] = change(np.array(view[name])).tolist()

    return edit


def millimetres(pose):
    pose[:3, 3] *= 1000
    return pose


CAMERAS = {
    "translations in millimetres": (edited(world_from_camera=millimetres), "views", "world_from_camera says"),
    "depth in tenths of a millimetre": (
        lambda about, files: about.update(depth_scale=0.0001),
        "views",
        "depth says that the object is 0.0",
    ),
    "focal length of 1e308": (edited(K=lambda K: K * [[1e305, 1, 1], [1, 1, 1], [1, 1, 1]]), "views[0].K", "no camera's"),
    "focal length in metres": (edited(K=lambda K: K * [[1e-5, 1, 1], [1, 1e-5, 1], [1, 1, 1]]), "views[0].K", "no camera's"),
    "a skew of 1e300": (edited(K=lambda K: K + [[0, 1e300, 0], [0, 0, 0], [0, 0, 0]]), "views[0].K", "skew"),
    "a rotation of 1e200": (edited(world_from_camera=lambda pose: pose * 1e200), "views[0].world_from_camera", "last row"),
    "a camera in the next galaxy": (
        edited(world_from_camera=lambda pose: pose + 1e22 * np.eye(4)[:, 3:] @ np.zeros((1, 4)) + _far()),
        "views[0].world_from_camera",
        "from the world's origin",
    ),
    "a sheared rotation": (
        edited(world_from_camera=lambda pose: pose @ (np.eye(4) + 0.01 * np.eye(4, k=1))),
        "views[0].world_from_camera",
        "not a rotation",
    ),
}


def _far():
    far = np.zeros((4, 4))
    far[0, 3] = 1e22
    return far


@pytest.mark.parametrize("case", CAMERAS)
def test_cameras_that_cannot_be(client, look, parts, case):
    edit, field, word = CAMERAS[case]
    for address in ("/v1/observations", "/v1/scans"):
        refused(client.post(address, files=parts(look(), edit)), 422, field, word)


def test_a_scan_in_another_unit_makes_no_category(client, look, parts):
    scan = client.post("/v1/observations", files=parts(look())).json()["scan"]
    assert client.post(f"/v1/scans/{scan['id']}/views", files=parts(look(), edited(world_from_camera=millimetres))).status_code == 200
    refused(client.post(f"/v1/scans/{scan['id']}/complete"), 422, "views", "world_from_camera says")
    assert client.get("/v1/categories").json()["categories"] == []


def test_cameras_at_the_same_place_are_told_of(client, look, parts, learn):
    learn()
    one = look(views=1).views[0]
    seen = client.post("/v1/observations", files=parts(Burst([one] * 4)))
    assert seen.status_code == 201
    found = seen.json()["grounds"]
    assert "within 0°" in found["weakness"]
    assert [[fault["kind"] for fault in view] for view in found["faults"]] == [[], ["copy"], ["copy"], ["copy"]]
    scan = client.post("/v1/scans", json={"observation_id": seen.json()["id"]})
    assert scan.status_code in {201, 422}


def test_views_of_two_objects_in_one_burst_are_told_of(client, look, parts):
    from core.sim3 import Sim3

    other = look("dark", views=1, world_from_object=Sim3(1.0, np.eye(3), np.array([1.5, 0, 0])))
    seen = client.post("/v1/observations", files=parts(Burst(look(views=4).views + other.views))).json()
    assert [[fault["kind"] for fault in view] for view in seen["grounds"]["faults"]] == [[], [], [], [], ["elsewhere"]]


def burst_part(files, content):
    files[0] = ("burst", ("burst.json", content, "application/json"))
    return files


PARTS = {
    "a million views": (b'{"views": [' + b",".join([b"{}"] * 1_000_000) + b"]}", "burst", "ONELOOK_MAX_VIEWS"),
    "more views than images": (b'{"views": [' + b",".join([b"{}"] * 5_000) + b"]}", "burst.views", "5000 entries for 6 rgb images"),
    "deep nesting": (b'{"views": ' + b"[" * 50_000, "burst", "is not JSON"),
    "a number of ten thousand digits": (b'{"depth_scale": ' + LONG_NUMBER + b"}", "burst", "is not JSON"),
    "an entry of ten thousand digits": (b'{"views": [{"K": [' + b",".join([LONG_NUMBER] * 9) + b"]}]}", "burst", "is not JSON"),
    "a number beyond all numbers": (b'{"depth_scale": 1e999}', "burst.depth_scale", ""),
    "no number": (b'{"depth_scale": NaN}', "burst.depth_scale", ""),
    "half a surrogate": (b'{"frame": "\\ud800"}', "burst", "is not JSON"),
    "no UTF-8": (b'{"frame": "\xff\xfe"}', "burst", ""),
    "a byte order mark": (b"\xef\xbb\xbf{}", "burst", ""),
}


@pytest.mark.parametrize("case", PARTS)
def test_hostile_json_parts(client, look, parts, case):
    content, field, word = PARTS[case]
    answer = client.post("/v1/observations", files=burst_part(parts(look()), content))
    assert answer.json()["field"].startswith(field)
    refused(answer, 422, answer.json()["field"], word)


BODIES = {
    "deep nesting": DEEP,
    "a number of ten thousand digits": b'{"name": ' + LONG_NUMBER + b"}",
    "half a surrogate": b'{"name": "\\ud800"}',
    "no UTF-8": b'{"name": "\xff"}',
    "a list of a million": b"[" + b"1," * 999_999 + b"1]",
    "null": b"null",
    "nothing": b"",
}


@pytest.mark.parametrize("body", BODIES)
def test_hostile_json_bodies(client, learn, body):
    category = learn()
    for method, path in (("PATCH", ""), ("POST", "/merge"), ("POST", "/split"), ("POST", "/goals")):
        answer = client.request(method, f"/v1/categories/{category['id']}{path}", content=BODIES[body], headers=JSON)
        assert answer.status_code == 422, answer.text[:300]
        assert answer.json()["type"] == "urn:onelook:problem:invalid-input"


NAMES = ["Ø杯🏆", "\u202egnp.exe", "a\0b", "z\u0335\u0321" * 60, "'; DROP TABLE categories; --", "../../etc/passwd", " \t "]


@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_names_are_text_and_nothing_else(client, learn, name):
    category = learn()
    renamed = client.patch(f"/v1/categories/{category['id']}", json={"name": name})
    assert (renamed.status_code, renamed.json()["name"]) == (200, name)
    assert [each["name"] for each in client.get("/v1/categories").json()["categories"]] == [name]
    assert client.get(f"/categories/{category['id']}").status_code == 200
    again = client.post("/v1/memory/export")
    assert again.status_code == 200


@pytest.mark.parametrize("header", ["Idempotency-Key", "X-Actor", "If-None-Match", "Authorization", "X-Request-Id"])
@pytest.mark.parametrize("value", [b"\xff\xfe", b"a" * 20_000, b"\x01\x02", b'"', b"W/"])
def test_hostile_headers(client, look, parts, header, value):
    for answer in (
        client.post("/v1/scans", json={"observation_id": "x"}, headers={header: value}),
        client.get("/v1/categories", headers={header: value}),
    ):
        assert answer.status_code in {200, 304, 401, 404, 422}
        assert "Traceback" not in answer.text


MULTIPART = {"content-type": "multipart/form-data; boundary=xx"}
FORMS_OF_MULTIPART = {
    "no end": b'--xx\r\nContent-Disposition: form-data; name="burst"\r\n\r\n{}',
    "no name": b"--xx\r\nContent-Disposition: form-data\r\n\r\n{}\r\n--xx--\r\n",
    "no headers": b"--xx\r\n\r\n{}\r\n--xx--\r\n",
    "a name that is no text": b'--xx\r\nContent-Disposition: form-data; name="\xff\xfe"\r\n\r\n{}\r\n--xx--\r\n',
    "a charset that there is not": b'--xx\r\nContent-Disposition: form-data; name="burst"\r\nContent-Type: a/b; charset=z\r\n\r\n{}\r\n',
    "ten thousand headers": b"--xx\r\n" + b"A: b\r\n" * 10_000 + b"\r\n{}\r\n--xx--\r\n",
    "ten thousand parts": b'--xx\r\nContent-Disposition: form-data; name="rgb"; filename="a"\r\n\r\n\r\n' * 10_000 + b"--xx--\r\n",
    "ten thousand fields": b'--xx\r\nContent-Disposition: form-data; name="rgb"\r\n\r\n\r\n' * 10_000 + b"--xx--\r\n",
    "a path for a file": b'--xx\r\nContent-Disposition: form-data; name="rgb"; filename="../../x"\r\n\r\nx\r\n--xx--\r\n',
    "nothing": b"",
    "only the boundary": b"--xx--",
    "another boundary": b"--yy\r\n\r\n--yy--",
}


@pytest.mark.parametrize("form", FORMS_OF_MULTIPART)
def test_malformed_multipart(client, form):
    answer = client.post("/v1/observations", content=FORMS_OF_MULTIPART[form], headers=MULTIPART)
    assert answer.status_code == 422, answer.text[:300]
    assert "Traceback" not in answer.text

"""Images and arrays that are meant to break the service: unusual forms are read, and what unpacks to far more than was sent is not."""

from __future__ import annotations

import io
import struct
import tracemalloc
import zipfile
import zlib

import cv2
import numpy as np
import pytest
from PIL import Image

from tests.service.problems import refused

NPZ = {"content-type": "application/x-npz"}


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
    "text that unpacks to 100 MB": (
        png_of(
            [
                (b"IHDR", struct.pack(">IIBBBBB", 64, 64, 8, 2, 0, 0, 0)),
                *[(b"zTXt", b"a\0\0" + zlib.compress(bytes(10_000_000)))] * 10,
                (b"IDAT", zlib.compress(bytes(64 * (64 * 3 + 1)))),
                (b"IEND", b""),
            ]
        ),
        "is a broken PNG file",
    ),
    "pixels that unpack to far more than the size says": (
        png_of(
            [
                (b"IHDR", struct.pack(">IIBBBBB", 64, 64, 8, 2, 0, 0, 0)),
                (b"IDAT", zlib.compress(bytes(200_000_000))),
                (b"IEND", b""),
            ]
        ),
        "outside the 64×64 image",  # as large as it says, which the others of the burst are not
    ),
    "a JPEG of a thousand scans": (b"\xff\xd8\xff\xe0" + b"\xff\xda\0\x0c" * 1000, "of 1000 scans, at most 100 are decoded"),
    "no pixels": (png_of([(b"IHDR", struct.pack(">IIBBBBB", 0, 0, 8, 2, 0, 0, 0)), (b"IEND", b"")]), "is a broken PNG file"),
    "four thousand million pixels a side": (
        png_of([(b"IHDR", struct.pack(">IIBBBBB", 2**32 - 1, 2**32 - 1, 8, 2, 0, 0, 0)), (b"IEND", b"")]),
        "at most 16 megapixels are accepted",
    ),
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_image_bombs_are_refused_in_words_and_take_no_memory(client, look, parts, bomb):
    content, said = BOMBS[bomb]
    files = parts(look(), lambda about, files: files["rgb"].__setitem__(1, content))
    tracemalloc.start()
    answer = client.post("/v1/observations", files=files)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert (answer.status_code, said in answer.json()["detail"]) == (422, True), answer.text
    assert peak < 60_000_000


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

"""JSON, names, headers and multipart that are meant to break the service, or that a broken robot sends: never a 500."""

from __future__ import annotations

import pytest

from tests.service.problems import refused

JSON = {"content-type": "application/json"}
DEEP = b"[" * 200_000
LONG_NUMBER = b"9" * 10_000


def burst_part(files, content):
    files[0] = ("burst", ("burst.json", content, "application/json"))
    return files


PARTS = {
    "a million views": (b'{"views": [' + b",".join([b"{}"] * 1_000_000) + b"]}", "burst", "ONELOOK_MAX_VIEWS"),
    "more views than images": (b'{"views": [' + b",".join([b"{}"] * 5_000) + b"]}", "views", "5000 entries for 6 rgb images"),
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
def test_hostile_json_parts_are_refused_by_field(client, look, parts, case):
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
def test_hostile_json_bodies_are_refused(client, learn, body):
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
def test_hostile_headers_are_no_fault_of_the_service(client, look, parts, header, value):
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
def test_malformed_multipart_is_refused(client, form):
    answer = client.post("/v1/observations", content=FORMS_OF_MULTIPART[form], headers=MULTIPART)
    assert answer.status_code == 422, answer.text[:300]
    assert "Traceback" not in answer.text

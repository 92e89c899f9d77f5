"""One call's way to its answer: what is sent again, after how long, and what becomes of failures.

Written as a generator that never sends nor waits itself, so that the synchronous and the asynchronous client share it.

A request is sent again where that cannot do a thing twice: reads always, and changes because each carries an idempotency key, by which
the service knows a request that it has already carried out.
"""

from __future__ import annotations

import math
import os
import random
import uuid
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from email.utils import parsedate_to_datetime
from typing import Any, TypeVar

import httpx
from websockets.exceptions import InvalidStatus, WebSocketException

from clients.calls.call import Call
from clients.errors import ServiceProblem, TooSlow, Unreachable, problem_from_json
from core.errors import InvalidInput

T = TypeVar("T")
KEY = "Idempotency-Key"
KEY_VARIABLE = "ONELOOK_API_KEY"
TRY_AGAIN = frozenset({429, 502, 503, 504})
"""Statuses of a service, or a proxy before it, that is busy or restarting; any other one is asked again only if it has Retry-After."""
PROBLEM = "application/problem+json"


@dataclass(frozen=True)
class Retry:
    """How often and after how long a request is sent again."""

    attempts: int = 4
    """In all; 1 never sends again."""
    first_s: float = 0.25
    """Wait before the second attempt; it doubles with each one."""
    longest_s: float = 30.0
    """No wait is longer: a service that asks for more (Retry-After) is reported as unavailable."""


@dataclass(frozen=True)
class Wait:
    """Asks the client to wait."""

    seconds: float


Answered = httpx.Response | httpx.TransportError | None
"""What came of a request; None after a wait."""
Exchange = Generator[Call[T] | Wait, Answered, T]


def exchange(call: Call[T], retry: Retry, url: str) -> Exchange[T]:
    """Yields what is to be sent or waited for, takes what came of it, and returns the answer.

    Raises Unreachable, TooSlow, or the ServiceProblem that was answered.
    """
    key = uuid.uuid4().hex
    if call.method in {"POST", "PATCH"}:
        call = _with_key(call, key)
    jitter = random.Random(key)
    for attempt in range(1, retry.attempts + 1):
        came = yield call
        assert came is not None
        if isinstance(came, httpx.Response) and is_answer(came):
            return call.read(came)
        if attempt > 1 and call.method == "DELETE" and isinstance(came, httpx.Response) and came.status_code == 404:
            return call.read(came)  # the first attempt deleted it, and its answer was lost
        wait_s = _wait_s(came, attempt, retry, jitter)
        if wait_s is None or attempt == retry.attempts:
            raise _failure(came, call, url) from None
        yield Wait(wait_s)
    raise AssertionError("a retry has at least one attempt")


def is_answer(response: httpx.Response) -> bool:
    """Whether the service has done what it was asked for. A page or a redirection is another server's, whatever its status says."""
    return response.is_success and not response.headers.get("content-type", "").startswith("text/html")


def _with_key(call: Call[T], key: str) -> Call[T]:
    headers = {**call.body.get("headers", {}), KEY: key}
    if "files" in call.body:
        # Else each attempt would separate the parts by another word, and the service would take it for another request.
        headers["Content-Type"] = f"multipart/form-data; boundary={key}"
    return replace(call, body={**call.body, "headers": headers})


def _wait_s(came: httpx.Response | httpx.TransportError, attempt: int, retry: Retry, jitter: random.Random) -> float | None:
    """How long to wait before the next attempt; None where another one would not help."""
    backoff_s = min(retry.longest_s, retry.first_s * 2 ** (attempt - 1)) * jitter.uniform(0.5, 1)
    if isinstance(came, httpx.Response):
        asked_s = retry_after_s(came.headers)
        if asked_s is not None:
            return None if asked_s > retry.longest_s else max(asked_s, backoff_s)
        # A service that says itself what it lacks (weights, disk) would name a time if waiting mended it.
        told = came.status_code == 503 and came.headers.get("content-type", "").startswith(PROBLEM)
        return backoff_s if came.status_code in TRY_AGAIN and not told else None
    return None if isinstance(came, (httpx.ReadTimeout, httpx.WriteTimeout)) else backoff_s


def retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Seconds that Retry-After asks to wait, as a number or as a date (RFC 9110, 10.2.3); None where it says nothing that can be read."""
    value = headers.get("retry-after", "")
    try:
        seconds = float(value)
    except ValueError:
        try:
            when = parsedate_to_datetime(value)
        except ValueError:
            return None
        seconds = (when.replace(tzinfo=when.tzinfo or timezone.utc) - datetime.now(timezone.utc)).total_seconds()
    return max(0.0, seconds) if math.isfinite(seconds) else None


def _failure(came: httpx.Response | httpx.TransportError, call: Call[Any], url: str) -> Exception:
    if isinstance(came, httpx.Response):
        return problem_of(came)
    if isinstance(came, httpx.TimeoutException) and not isinstance(came, httpx.ConnectTimeout):
        return TooSlow(f"{url} did not answer {call.method} {call.path} in time; send fewer views, or allow more time")
    return broken(came, url)


def broken(why: Exception, url: str) -> Unreachable:
    """The exception for a connection that was not made, or did not last."""
    if isinstance(why, (httpx.ConnectError, httpx.ConnectTimeout)):
        return _no_connection(why, url)
    return Unreachable(f"the connection to {url} broke ({_reason(why)}); look at the service's log")


def _no_connection(why: Exception, url: str) -> Unreachable:
    return Unreachable(f"no connection to {url} ({_reason(why)}); start the service with `onelook serve`, or give its address")


def _reason(error: BaseException) -> str:
    """What the operating system or TLS said first: the exceptions of asyncio above it do not repeat it.

    Contexts are not followed: they lead to what the caller may be handling meanwhile. httpcore has what it was raised for among its `args`.
    """
    said, beneath = str(error) or type(error).__name__, error
    while found := beneath.__cause__ or next((each for each in beneath.args if isinstance(each, BaseException)), None):
        beneath = found
        if isinstance(beneath, OSError) and str(beneath):
            said = str(beneath)
    return said


def address(url: str) -> str:
    """The address itself. Raises InvalidInput where no service can be at it."""
    try:
        parsed = httpx.URL(url)
        parsed.host.encode("idna")
    except (httpx.InvalidURL, UnicodeError):
        parsed = httpx.URL()
    if parsed.scheme not in {"http", "https"} or not parsed.host:
        raise InvalidInput("url", f"expected an address such as http://127.0.0.1:8000 or http://[::1]:8000, found {url!r}")
    return url


def key_header(api_key: str | None) -> dict[str, str]:
    """The header that a key travels in; the environment's key where None is given, no header where it has none either."""
    key = os.environ.get(KEY_VARIABLE) if api_key is None else api_key
    return {"Authorization": f"Bearer {key}"} if key else {}


def authorization(headers: httpx.Headers) -> dict[str, str]:
    """That header of a connection, for another one to the same service."""
    return {"Authorization": headers["Authorization"]} if "Authorization" in headers else {}


@contextmanager
def connection_to(url: str) -> Iterator[None]:
    """Makes what is wrong with a WebSocket Unreachable, and a refusal the ServiceProblem that it tells of."""
    try:
        yield
    except InvalidStatus as error:
        refused = error.response
        raise problem_of(
            httpx.Response(refused.status_code, headers=list(refused.headers.raw_items()), content=bytes(refused.body))
        ) from None
    except (OSError, WebSocketException) as error:
        raise _no_connection(error, url) from None


def endless(timeout: httpx.Timeout) -> httpx.Timeout:
    """The same, but for reading: events may be hours apart."""
    return httpx.Timeout(connect=timeout.connect, write=timeout.write, pool=timeout.pool, read=None)


def problem_of(response: httpx.Response) -> ServiceProblem:
    """The exception for an answer that is none (`is_answer`)."""
    if response.headers.get("content-type", "").startswith(PROBLEM):
        return problem_from_json(response.status_code, response.json(), retry_after_s(response.headers))
    found = f"{response.url} answered {response.status_code} {response.reason_phrase}"
    return problem_from_json(response.status_code, {"detail": f"{found}, which is no answer of this service; check the address"})

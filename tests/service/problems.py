"""What tests say of an answer that is a problem."""

from __future__ import annotations

import httpx


def refused(answer: httpx.Response, status: int, field: str | None, *words: str) -> None:
    """Asserts a problem about `field` whose detail has all `words`, and that nothing of the inside is shown."""
    problem = answer.json()
    assert (answer.status_code, problem["status"], problem.get("field")) == (status, status, field), answer.text[:500]
    assert answer.headers["content-type"] == "application/problem+json"
    assert set(problem) <= {"type", "title", "status", "detail", "field", "errors"}, problem
    assert "Traceback" not in answer.text
    for word in words:
        assert word in problem["detail"], problem["detail"]

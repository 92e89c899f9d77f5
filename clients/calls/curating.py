"""Categories: inspect, name, correct, forget."""

from __future__ import annotations

from collections.abc import Sequence

from clients.answers.categories import Category, Instance, Similarities
from clients.calls.call import Call, nothing, reading, reading_list


def categories() -> Call[list[Category]]:
    """All categories, oldest first."""
    return Call("GET", "/v1/categories", reading_list("categories", Category.from_json))


def category(category_id: str) -> Call[Category]:
    """One category."""
    return Call("GET", f"/v1/categories/{category_id}", reading(Category.from_json))


def rename(category_id: str, name: str | None) -> Call[Category]:
    """Says what people call a category; None takes the name away."""
    return Call("PATCH", f"/v1/categories/{category_id}", reading(Category.from_json), body={"json": {"name": name}})


def forget(category_id: str) -> Call[None]:
    """Deletes a category and what it was learnt from."""
    return Call("DELETE", f"/v1/categories/{category_id}", nothing)


def merge(category_id: str, other_id: str) -> Call[Category]:
    """The bursts of the other category join this one, which keeps its reference, name and goals; the other one is gone."""
    return Call("POST", f"/v1/categories/{category_id}/merge", reading(Category.from_json), body={"json": {"from": other_id}})


def split(category_id: str, instance_ids: Sequence[str], name: str | None = None) -> Call[Category]:
    """Some bursts leave for a new category, whose reference is made of the first of them whose views allow it."""
    body = {"json": {"instance_ids": list(instance_ids), "name": name}}
    return Call("POST", f"/v1/categories/{category_id}/split", reading(Category.from_json), body=body)


def instances(category_id: str) -> Call[list[Instance]]:
    """The bursts assigned to a category, oldest first."""
    return Call("GET", f"/v1/categories/{category_id}/instances", reading_list("instances", Instance.from_json))


def forget_instance(category_id: str, instance_id: str) -> Call[None]:
    """Takes a burst out of a category, such as one that was recognised wrongly."""
    return Call("DELETE", f"/v1/categories/{category_id}/instances/{instance_id}", nothing)


def similarities(category_id: str) -> Call[Similarities]:
    """How like each other a category's bursts are, and how like it the other categories."""
    return Call("GET", f"/v1/categories/{category_id}/similarity", reading(Similarities.from_json))


def cloud(category_id: str) -> Call[bytes]:
    """A category's reference points, metres, as a PLY file."""
    return Call("GET", f"/v1/categories/{category_id}/cloud.ply", lambda response: response.content)

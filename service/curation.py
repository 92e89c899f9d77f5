"""What a person or a robot changes in the memory by their own word: names, merges, splits, corrections, forgetting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.errors import Conflict, InvalidInput, Unavailable
from core.look import Encodes, look
from core.packing import burst_from_arrays
from core.reference import MIN_VIEWS, build_reference
from core.scores import SCORES
from core.views import Burst, FloatArray
from service.events import Events
from store.memory import Memory
from store.records import Category, Instance, Observation

OVERVIEW = "pooled_best_view"
"""Stands in for `best`, whose evidence depends on what else is known."""


@dataclass(frozen=True, eq=False)
class Similarities:
    """How like each other a category's bursts are, and how like it the other categories."""

    instances: tuple[Instance, ...]
    matrix: FloatArray
    """Of each pair of instances, shape (I, I)."""
    categories: tuple[tuple[str, float], ...]
    """(id, similarity) of the other categories, most similar first."""
    score: str
    """By which all of this is told."""


@dataclass(frozen=True, eq=False)
class MergePreview:
    """What a merge would do."""

    gone: Category
    stays: Category
    goals: int
    """Of the one that goes: nobody can ask for them any more."""
    similarity: float | None
    """Between the most alike of their bursts."""
    within: float | None
    """The same within the one that stays; None where it has one burst."""
    nearest: bool
    """Whether no other category is as like the one that goes."""
    score: str


class Curation:
    """Changes of one memory's categories."""

    def __init__(self, encoder: Encodes, memory: Memory, events: Events, score: str) -> None:
        self._encoder = encoder
        self._memory = memory
        self._events = events
        self._score = score if score in SCORES else OVERVIEW

    def rename(self, category_id: str, name: str | None, *, actor: str | None = None) -> Category:
        """Raises NotFound."""
        category = self._memory.categories.rename(category_id, name, actor=actor)
        self._events.publish("category_renamed", id=category_id, name=name)
        return category

    def delete(self, category_id: str, *, actor: str | None = None) -> None:
        """Forgets a category with all its bursts. Raises NotFound."""
        self._memory.categories.delete(category_id, actor=actor)
        self._events.publish("category_deleted", id=category_id)

    def merge(self, category_id: str, into_id: str, *, actor: str | None = None) -> Category:
        """The bursts of one category join another, whose reference stays. Raises NotFound, InvalidInput for a category with itself."""
        _require_two("from", category_id, into_id)
        category = self._memory.categories.merge(category_id, into_id, actor=actor)
        self._events.publish("category_merged", id=category_id, into=into_id)
        return category

    def preview_merge(self, category_id: str, into_id: str) -> MergePreview:
        """What `merge` would do; changes nothing. Raises as it does, and Unavailable where tokens are damaged."""
        _require_two("into", category_id, into_id)
        gone, stays = (self._memory.categories.get(each) for each in (category_id, into_id))
        between, inside = self.similarities(category_id), self.similarities(into_id)
        own = np.eye(len(inside.matrix), dtype=bool)
        within = float(inside.matrix[~own].max()) if len(own) > 1 else None
        similarity = dict(between.categories).get(into_id)
        goals = len(self._memory.goals.of(category_id))
        return MergePreview(gone, stays, goals, similarity, within, between.categories[0][0] == into_id, between.score)

    def split(self, category_id: str, instance_ids: Sequence[str], name: str | None, *, actor: str | None = None) -> Category:
        """Bursts leave their category for a new one, whose reference is made of the first of them that allows it.

        Raises NotFound, InvalidInput for instances of another category or all of this one's, Conflict where none can be a reference.
        """
        self._memory.categories.get(category_id)
        own = {instance.id for instance in self._memory.instances.of(category_id)}
        chosen = list(dict.fromkeys(instance_ids))
        for index, instance_id in enumerate(chosen):
            if instance_id not in own:
                raise InvalidInput(f"instance_ids[{index}]", f"{instance_id!r} is no instance of category {category_id!r}")
        if len(chosen) == len(own):
            raise InvalidInput("instance_ids", "are all instances of the category; leave it at least one, or rename it")
        burst = self._reference_burst(chosen)
        reference = build_reference(look(burst, self._encoder).encoded)
        category = self._memory.categories.split(category_id, chosen, reference, burst, name=name, actor=actor)
        self._events.publish("category_split", id=category.id, name=name, split_from=category_id)
        return category

    def correct(self, observation_id: str, category_id: str | None, name: str | None = None, *, actor: str | None = None) -> Observation:
        """An observation was of another category than was answered; of a new one, made of its own views, where that is None.

        Its burst joins that category, and leaves the one it had joined. Raises NotFound, Conflict where it is there already or cannot
        make a category.
        """
        encoded = burst_from_arrays(self._memory.observations.features(observation_id))
        if category_id is not None:
            self._memory.categories.get(category_id)
            self._memory.corrections.to_category(observation_id, category_id, encoded, actor=actor)
        else:
            burst = self._memory.observations.burst(observation_id)
            sound = _sound(burst)
            if len(sound) < MIN_VIEWS:
                raise Conflict(
                    f"the views of observation {observation_id!r} cannot make a category: that takes at least {MIN_VIEWS} with cameras and "
                    "depth; scan the object instead (POST /v1/scans)"
                )
            reference = build_reference(encoded.select(sound))
            category_id = self._memory.corrections.to_new(observation_id, reference, burst.select(sound), encoded, name=name, actor=actor)
        self._events.publish("observation_corrected", id=observation_id, category_id=category_id)
        return self._memory.observations.get(observation_id)

    def forget_instance(self, category_id: str, instance_id: str, *, actor: str | None = None) -> None:
        """Takes a burst out of a category. Raises NotFound, Conflict for its last one."""
        self._memory.instances.forget(category_id, instance_id, actor=actor)
        self._events.publish("instance_forgotten", id=instance_id, category_id=category_id)

    def similarities(self, category_id: str) -> Similarities:
        """By the score that decides, where it compares two bursts and nothing else, or by OVERVIEW.

        Raises NotFound, and Unavailable where tokens of the category are damaged.
        """
        self._memory.categories.get(category_id)
        score = SCORES[self._score]
        bursts: dict[str, list[FloatArray]] = {}
        for member in self._memory.instances.members():
            bursts.setdefault(member.category_id, []).append(score.tokens(member))
        instances = tuple(self._memory.instances.of(category_id))
        own = bursts.pop(category_id, [])
        if len(own) != len(instances):
            raise Unavailable(f"tokens of category {category_id!r} are damaged; `onelook memory check` says which")
        matrix = np.array([[score.similarity(left, right) for right in own] for left in own])
        others = {each: max(score.similarity(left, right) for left in own for right in theirs) for each, theirs in bursts.items()}
        ranked = sorted(others.items(), key=lambda entry: (-entry[1], entry[0]))
        return Similarities(instances, matrix, tuple(ranked), self._score)

    def _reference_burst(self, instance_ids: Sequence[str]) -> Burst:
        for instance_id in instance_ids:
            if not self._memory.instances.get(instance_id).kept:
                continue
            burst = self._memory.instances.burst(instance_id)
            sound = _sound(burst)
            if len(sound) >= MIN_VIEWS:
                return burst.select(sound)
        raise Conflict(
            f"none of these instances can be a reference: that takes the kept views of one, at least {MIN_VIEWS} with cameras and depth; "
            "scan the object instead"
        )


def _require_two(field: str, category_id: str, into_id: str) -> None:
    if category_id == into_id:
        raise InvalidInput(field, "is the category itself; name another one")


def _sound(burst: Burst) -> list[int]:
    """Views that a reference can be made of."""
    return [index for index, view in enumerate(burst.views) if view.camera is not None and view.depth_m is not None]

"""A Dockerfile as its stages and their steps."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path

KNOWN = {"ARG", "CMD", "COPY", "ENTRYPOINT", "ENV", "EXPOSE", "HEALTHCHECK", "RUN", "USER", "VOLUME", "WORKDIR"}


@dataclass(frozen=True)
class Step:
    """One instruction."""

    name: str
    """`RUN`, `COPY`, …"""
    text: str
    """What follows, lines joined."""

    @property
    def words(self) -> list[str]:
        """The text as words: of a JSON list its entries, else what a shell would see."""
        return list(json.loads(self.text)) if self.text.startswith("[") else shlex.split(self.text)


@dataclass
class Stage:
    """What is between one FROM and the next."""

    name: str
    base: str
    """An image, or an earlier stage."""
    steps: list[Step] = field(default_factory=list)

    def last(self, name: str) -> Step | None:
        """The step of this kind that counts."""
        return next((step for step in reversed(self.steps) if step.name == name), None)


def read_recipe(dockerfile: Path) -> dict[str, Stage]:
    """Stages by name, in their order. Raises ValueError for an instruction that is none of KNOWN."""
    lines = [line for line in dockerfile.read_text().splitlines() if not line.lstrip().startswith("#")]
    joined = re.sub(r"\\\n\s*", " ", "\n".join(lines))
    stages: dict[str, Stage] = {}
    for line in filter(str.strip, joined.splitlines()):
        name, _, text = line.strip().partition(" ")
        if name == "FROM":
            base, _, called = text.partition(" AS ")
            stage = stages[called] = Stage(called, base)
        elif name in KNOWN:
            stage.steps.append(Step(name, text.strip()))
        else:
            raise ValueError(f"{dockerfile} has an instruction {name} that this cannot carry out")
    return stages


def lineage(stages: dict[str, Stage], name: str) -> list[Stage]:
    """A stage after those it builds on, the first one first."""
    stage = stages[name]
    return [*(lineage(stages, stage.base) if stage.base in stages else []), stage]


def settings(stages: list[Stage]) -> dict[str, str]:
    """The ENV of a lineage."""
    return {
        name: value
        for stage in stages
        for step in stage.steps
        if step.name == "ENV"
        for name, value in (each.split("=", 1) for each in step.words)
    }

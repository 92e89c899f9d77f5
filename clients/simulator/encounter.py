"""One object met: what was decided, what that was worth, and the pose's error; all of it plain, so that a file can hold it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

import numpy as np

from clients.pose_error import PoseError
from clients.simulator.waypoints import Waypoint
from clients.simulator.world import WorldObject
from core.sim3 import Sim3


class Verdict(Enum):
    """What a decision was worth, given the true categories."""

    NEW = "new category"
    """Novel, and rightly so."""
    RECOGNISED = "recognised"
    """Known, as the category that an object of the same kind founded."""
    FALSE_NOVEL = "false novel"
    """Novel, though its category is in the memory."""
    FALSE_KNOWN = "false known"
    """Known as a category that another kind of object founded."""
    UNDECIDED = "undecided"

    @property
    def right(self) -> bool:
        """Whether the memory got it right."""
        return self in {Verdict.NEW, Verdict.RECOGNISED}


@dataclass(frozen=True, eq=False)
class Founder:
    """The object that a category was learnt from."""

    category: str
    name: str
    world_from_model: Sim3 | None
    """In the world frame of its scan."""

    @staticmethod
    def of(thing: WorldObject) -> Founder:
        """A thing as it stands now."""
        return Founder(thing.category, thing.name, thing.world_from_model)


@dataclass(frozen=True)
class Encounter:
    """See module."""

    number: int
    """From 1, in the order met."""
    name: str
    """`category/instance` of the object."""
    category: str
    """Its true category."""
    observation_id: str
    """Empty where the service saw no object, and kept nothing."""
    outcome: str
    verdict: Verdict
    category_id: str | None
    """The category decided for."""
    kind: str | None
    """True category of the object that founded it; None where there is none."""
    nearest_kind: str | None
    """True category of the object that founded the most similar category, whatever was decided."""
    similarity: float | None
    """To that category; None where the memory was empty."""
    threshold: float | None
    in_memory: bool
    """Whether an object of its category had founded one before."""
    has_truth: bool
    """Whether the object's true pose is known, so that a pose can be scored."""
    error: PoseError | None
    """Of the pose of a rightly recognised object."""
    learnt: str | None
    """The category that the scan of a novel object made."""
    learnt_views: int
    """Views that it was made of."""
    founder_matrix: list[list[float]] | None
    """world_from_model of an object that founded a category, 4×4."""
    best_view: int
    """Index in the burst of the view in which most correspondences agree with the pose; 0 where there is no pose."""
    views: int
    """In the burst."""
    looks: int
    """Observations made: more than one where the service asked for further views."""
    offsets_deg: tuple[float, ...]
    """How far off the views brought were from those asked for."""
    refused: int
    """Viewpoints that the arm could not reach, nor any near them."""
    view_faults: tuple[str, ...]
    """What the service found wrong with views of the scan: each of those was taken once more from beside."""
    failure: str | None
    """Why there is no pose or no category where there should be one."""
    observe_ms: float
    """From sending the burst to having the answer."""
    scan_ms: float | None
    motion_s: float
    """Simulated time that the arm moved."""
    timings_ms: Mapping[str, float]
    """Milliseconds of each stage in the service, and their `total`."""
    robot: int = 0
    waypoints: tuple[Waypoint, ...] = ()
    """Of an object taken for known: the pose at each, from the view there alone."""
    waypoints_out_of_reach: int = 0

    def as_json(self) -> str:
        """One line."""
        return json.dumps({**asdict(self), "verdict": self.verdict.value})

    @staticmethod
    def from_json(line: str) -> Encounter:
        """The inverse of `as_json`."""
        fields: dict[str, Any] = json.loads(line)
        error = fields["error"]
        return Encounter(
            **{
                **fields,
                "verdict": Verdict(fields["verdict"]),
                "error": PoseError(**error) if error else None,
                "offsets_deg": tuple(fields["offsets_deg"]),
                "view_faults": tuple(fields["view_faults"]),
                "waypoints": tuple(Waypoint.from_plain(each) for each in fields["waypoints"]),
            }
        )

    @property
    def label(self) -> str:
        """Its number, and before it of which robot it is, where it is not the first one's."""
        return f"{self.robot + 1}.{self.number}" if self.robot else str(self.number)

    @property
    def founder(self) -> Founder:
        """The object as the founder of the category that was learnt from it."""
        matrix = self.founder_matrix
        return Founder(self.category, self.name, None if matrix is None else Sim3.from_matrix(np.array(matrix)))


def judge(outcome: str, category: str, founder: Founder | None, in_memory: bool) -> Verdict:
    """What a decision was worth.

    Args:
        category: the object's true category.
        founder: the object that founded the category decided for.
        in_memory: whether an object of the true category had founded one before.
    """
    if outcome == "novel":
        return Verdict.FALSE_NOVEL if in_memory else Verdict.NEW
    if outcome == "uncertain":
        return Verdict.UNDECIDED
    return Verdict.RECOGNISED if founder is not None and founder.category == category else Verdict.FALSE_KNOWN

"""Open-ended learning with a simulated teacher, who teaches, asks and corrects (Chauhan and Seabra Lopes, 2011).

The teacher introduces categories one at a time by showing an object. After each, she asks for the category of objects that the robot
has not seen, of all categories taught so far in turn, and corrects every wrong answer. Once the last answers are good enough she
introduces the next category; when they do not become so, the robot has reached its limit.
"""

from __future__ import annotations

import random
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from clients.robot import RobotClient
from clients.simulator.arm import Arm
from clients.simulator.episode import Conduct
from clients.simulator.scanning import COULD_NOT, learn_from_scan
from clients.simulator.world import Subject

Action = Literal["teach", "ask"]


@dataclass(frozen=True)
class TeacherConfig:
    """As the protocol has it."""

    accuracy: float = 0.67
    """Of the last answers, above which the next category is introduced."""
    window: int = 3
    """Answers a category known that count as the last ones."""
    patience: int = 100
    """Questions since the last new category after which the teacher gives up."""


@dataclass(frozen=True)
class Lesson:
    """One thing that the teacher did, and how it went."""

    number: int
    action: Action
    name: str
    """`category/instance` of the object shown."""
    category: str
    """Its true category."""
    answer: str | None
    """True category that the robot's answer stands for; None for `novel` and `uncertain`, and for what is taught."""
    right: bool
    corrected: bool
    """Whether the teacher told the right category, and the burst joined it."""
    known: int
    """Categories taught so far, this one included."""
    accuracy: float | None
    """Of the answers that count, after this one."""
    similarity: float | None
    failure: str | None
    seconds: float
    category_id: str | None = None
    """What the service calls the category that was taught."""


@dataclass(frozen=True)
class TeachingSummary:
    """What the protocol reports."""

    categories_learnt: int
    """Taught, and then answered well enough about."""
    categories_taught: int
    questions: int
    corrections: int
    accuracy: float
    """Of all answers, percent."""
    last_accuracy: float
    """Of the answers that counted at the end, percent."""
    instances_a_category: float
    """Bursts that the memory holds, over the categories taught."""
    ended: Literal["all learnt", "patience", "no more objects"]


class Lessons:
    """Iterate to teach; `summary` afterwards."""

    def __init__(
        self,
        robot: RobotClient,
        draw: Callable[[str, int], Subject],
        categories: list[str],
        conduct: Conduct,
        config: TeacherConfig | None = None,
        *,
        done: Sequence[Lesson] = (),
    ) -> None:
        """`draw(category, n)` gives the n-th object of a category; raises IndexError where there are no more.

        Args:
            done: the lessons of an earlier, interrupted run of the same kind, which are gone over without the robot.
        """
        self._robot = robot
        self._draw = draw
        self._conduct = conduct
        self._config = config or TeacherConfig()
        self._categories = list(categories)
        random.Random(conduct.seed).shuffle(self._categories)
        self._ids: dict[str, str] = {}
        self._shown: dict[str, int] = {}
        self._lessons: list[Lesson] = []
        self._done = deque(done)
        self._learnt = 0
        self._ended: Literal["all learnt", "patience", "no more objects"] = "all learnt"

    def __iter__(self) -> Iterator[Lesson]:
        """All lessons, the earlier ones first."""
        for category in self._categories:
            lesson = self._teach(category)
            yield lesson
            if lesson.failure:
                continue
            try:
                yield from self._ask_until_good()
            except IndexError:
                self._ended = "no more objects"
                return
            if self._ended == "patience":
                return
            self._learnt += 1

    @property
    def summary(self) -> TeachingSummary:
        """Of the lessons so far."""
        asked = [each for each in self._lessons if each.action == "ask"]
        taught = len(self._ids)
        stored = sum(each.instances for each in self._robot.categories())
        return TeachingSummary(
            categories_learnt=self._learnt,
            categories_taught=taught,
            questions=len(asked),
            corrections=sum(each.corrected for each in asked),
            accuracy=100 * sum(each.right for each in asked) / max(1, len(asked)),
            last_accuracy=100 * (asked[-1].accuracy or 0.0) if asked else 0.0,
            instances_a_category=stored / max(1, taught),
            ended=self._ended,
        )

    def _ask_until_good(self) -> Iterator[Lesson]:
        """Asks about all categories in turn, the newest first, until the last answers are good."""
        known = list(self._ids)[::-1]
        last: deque[bool] = deque(maxlen=self._config.window * len(known))
        for question in range(self._config.patience):
            lesson = self._ask(known[question % len(known)], last)
            yield lesson
            if question + 1 >= len(known) and (lesson.accuracy or 0.0) > self._config.accuracy:
                return
        self._ended = "patience"

    def _teach(self, category: str) -> Lesson:
        started = time.perf_counter()
        if self._done:
            return self._again(category)
        subject, arm = self._next(category)
        failure = None
        try:
            self._ids[category] = learn_from_scan(self._robot, arm, self._conduct.views, len(self._lessons)).id
        except COULD_NOT as problem:
            failure = str(problem)
        return self._keep("teach", subject, None, failure is None, False, None, None, failure, started)

    def _again(self, category: str) -> Lesson:
        """A lesson of the earlier run."""
        lesson = self._done.popleft()
        self._shown[category] = self._shown.get(category, 0) + 1
        if lesson.category_id is not None:
            self._ids[category] = lesson.category_id
        self._lessons.append(lesson)
        return lesson

    def _ask(self, category: str, last: deque[bool]) -> Lesson:
        started = time.perf_counter()
        if self._done:
            last.append(self._done[0].right)
            return self._again(category)
        subject, arm = self._next(category)
        burst = arm.glance(self._conduct.views, len(self._lessons))
        names = {category_id: name for name, category_id in self._ids.items()}
        answer, similarity, corrected, failure = None, None, False, None
        try:
            seen = self._robot.observe(burst, learn=False)
            similarity = seen.similarities[0].similarity if seen.similarities else None
            answer = names.get(seen.category_id or "") if seen.outcome == "known" else None
            if answer != category:
                self._robot.observe(burst, category_id=self._ids[category])
                corrected = True
        except COULD_NOT as problem:
            failure = str(problem)
        last.append(answer == category)
        return self._keep("ask", subject, answer, answer == category, corrected, sum(last) / len(last), similarity, failure, started)

    def _next(self, category: str) -> tuple[Subject, Arm]:
        """An object that the robot has not seen, in its world."""
        index = self._shown.get(category, 0)
        self._shown[category] = index + 1
        subject = self._draw(category, index)
        return subject, Arm(subject.enter(), self._conduct.arm)

    def _keep(
        self,
        action: Action,
        subject: Subject,
        answer: str | None,
        right: bool,
        corrected: bool,
        accuracy: float | None,
        similarity: float | None,
        failure: str | None,
        started: float,
    ) -> Lesson:
        number, seconds = len(self._lessons) + 1, time.perf_counter() - started
        lesson = Lesson(
            number=number,
            action=action,
            name=subject.name,
            category=subject.category,
            answer=answer,
            right=right,
            corrected=corrected,
            known=len(self._ids),
            accuracy=accuracy,
            similarity=similarity,
            failure=failure,
            seconds=seconds,
            category_id=self._ids.get(subject.category) if action == "teach" else None,
        )
        self._lessons.append(lesson)
        return lesson

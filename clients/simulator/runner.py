"""Runs a script against a service: shows, keeps and reports every encounter."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from rich.console import Console

from clients.robot import RobotClient
from clients.simulator import live
from clients.simulator.encounter import Encounter
from clients.simulator.episode import Episode, Truth, require_own_memory
from clients.simulator.fleet import disagreements, together
from clients.simulator.journal import interrupted, kept
from clients.simulator.pictures import fetch_pictures
from clients.simulator.report import EpisodeRecord, shown, write_json, write_report
from clients.simulator.script import Script
from clients.simulator.summary import Summary, summarise
from clients.simulator.teacher import Lesson, Lessons, TeachingSummary
from clients.simulator.world import Subject


@dataclass(frozen=True)
class Output:
    """Where a run keeps what."""

    folder: Path

    @property
    def lines(self) -> Path:
        """One JSON line an encounter, written as it happens."""
        return self.folder / "episode.jsonl"

    @property
    def lessons(self) -> Path:
        """One JSON line a lesson of the teacher's."""
        return self.folder / "lessons.jsonl"

    def earlier(self, script: Script) -> list[Encounter]:
        """The encounters of an interrupted run. Raises ClientError where there was none, or it was of another script."""
        return [Encounter.from_json(line) for line in interrupted(self.lines, script.as_settings())]

    def earlier_lessons(self, script: Script) -> list[Lesson]:
        """The same of a teacher's lessons."""
        return [Lesson(**json.loads(line)) for line in interrupted(self.lessons, script.as_settings())]


def run_episode(
    script: Script, subjects: Sequence[Sequence[Subject]], url: str, output: Output, console: Console, *, resume: bool = False
) -> Summary:
    """All encounters, the report and the JSON; returns the figures. Raises ClientError where the memory is not this episode's.

    `subjects` are the script's, of each robot: drawing them takes seconds.
    """
    done = output.earlier(script) if resume else []
    started = time.perf_counter()
    with ExitStack() as clients:
        robots = [clients.enter_context(RobotClient(url)) for _ in range(script.robots)]
        require_own_memory(robots[0], {each.learnt for each in done})
        truth = Truth()
        conduct = script.conduct()
        episodes = []
        for number, robot in enumerate(robots):
            own = [each for each in done if each.robot == number]
            episodes.append(Episode(robot, subjects[number], conduct, done=own, truth=truth, number=number))
        total = sum(len(each.subjects) for each in episodes)
        met = together(episodes) if len(episodes) > 1 else iter(episodes[0])
        live_ones = kept(met, output.lines, script.as_settings(), Encounter.as_json, done)
        encounters = [*done, *live.show(live_ones, total - len(done), console)]
        summary = summarise(encounters, time.perf_counter() - started)
        summary = replace(summary, disagreements=tuple(disagreements(robots[0], encounters)))
        with console.status("drawing the report"):
            record = _record(robots[0], script, encounters, summary)
    write_report(record, output.folder / "report.html")
    write_json(record, output.folder / "episode.json")
    console.print(live.summary_table(summary))
    wrong = "; ".join(summary.disagreements)
    if wrong or script.robots > 1:
        console.print(f"memory: {wrong or f'right after {script.robots} robots'}", style="red" if wrong else "green")
    console.print(f"\nreport: {output.folder / 'report.html'}")
    return summary


def run_lessons(
    script: Script, subjects: Sequence[Subject], url: str, output: Output, console: Console, *, resume: bool = False
) -> TeachingSummary:
    """All that the teacher does with the script's subjects; returns what the protocol reports."""
    groups: dict[str, list[Subject]] = {}
    for subject in subjects:
        groups.setdefault(subject.category, []).append(subject)
    done = output.earlier_lessons(script) if resume else []
    with RobotClient(url) as robot:
        require_own_memory(robot, {each.category_id for each in done})
        lessons = Lessons(robot, lambda category, index: groups[category][index], sorted(groups), script.conduct(), done=done)
        for lesson in kept(lessons, output.lessons, script.as_settings(), lambda lesson: json.dumps(asdict(lesson))):
            console.print(live.lesson_line(lesson), highlight=False)
        summary = lessons.summary
    console.print(live.teaching_table(summary))
    (output.folder / "teaching.json").write_text(json.dumps({"meta": script.as_settings(), "summary": asdict(summary)}, indent=1))
    return summary


def _record(robot: RobotClient, script: Script, encounters: Sequence[Encounter], summary: Summary) -> EpisodeRecord:
    pictures = {index: fetch_pictures(robot, encounters[index]) for index in shown(encounters)}
    return EpisodeRecord(summary, encounters, pictures, robot.categories(), robot.info(), script.as_settings())

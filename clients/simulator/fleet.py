"""Several robots at once against one service, each in a world of its own; and whether the memory is right afterwards."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator, Sequence

from clients.robot import RobotClient
from clients.simulator.encounter import Encounter
from clients.simulator.episode import Episode

Report = Encounter | BaseException | None
"""What a robot has to say: an encounter, what stopped it, or that it is through."""


def together(episodes: Sequence[Episode]) -> Iterator[Encounter]:
    """Encounters of all episodes as they happen, each episode in a thread. Raises what stopped one of them, when all have ended."""
    reports: queue.Queue[Report] = queue.Queue()
    stop = threading.Event()

    def run(episode: Episode) -> None:
        try:
            for encounter in episode:
                reports.put(encounter)
                if stop.is_set():
                    break
        except BaseException as error:  # reported to the one who waits, who raises it
            reports.put(error)
        else:
            reports.put(None)

    threads = [threading.Thread(target=run, args=(episode,), daemon=True) for episode in episodes]
    for thread in threads:
        thread.start()
    failure: BaseException | None = None
    running = len(threads)
    while running:
        report = reports.get()
        if isinstance(report, Encounter):
            yield report
            continue
        running -= 1
        if report is not None:
            failure = failure or report
            stop.set()
    if failure is not None:
        raise failure


def disagreements(robot: RobotClient, encounters: Sequence[Encounter]) -> list[str]:
    """Where the service's memory is not what the encounters made of it, in words; empty where it is right."""
    categories = {each.id: each for each in robot.categories()}
    found = []
    learnt = {each.learnt: each for each in encounters if each.learnt is not None}
    for category_id in learnt.keys() - categories.keys():
        found.append(f"the category {category_id} was learnt from {learnt[category_id].name}, and is gone")
    for category_id in categories.keys() - learnt.keys():
        found.append(f"the category {category_id} is there, and nobody learnt it")
    for category_id, encounter in learnt.items():
        category = categories.get(category_id or "")
        if category is None:
            continue
        joined = sum(each.category_id == category_id and each.outcome == "known" for each in encounters)
        if not 1 <= category.instances <= 1 + joined:
            found.append(f"{encounter.name}: its category holds {category.instances} bursts; {joined} joined the first one")
        if category.views != encounter.learnt_views:
            found.append(f"{encounter.name}: its category has {category.views} views; it was learnt from {encounter.learnt_views}")
    seen = [each.observation_id for each in encounters if each.observation_id]
    if len(set(seen)) < len(seen):
        found.append(f"{len(seen) - len(set(seen))} observations were given to two encounters")
    return found

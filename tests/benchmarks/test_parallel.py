"""Jobs in processes of their own."""

from __future__ import annotations

import os
from operator import neg

import pytest
from rich.progress import Progress

from benchmarks import parallel
from benchmarks.parallel import THREAD_SETTINGS, map_jobs, single_threaded_children


@pytest.fixture(autouse=True)
def two_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two processes whatever the machine has."""
    monkeypatch.setattr(parallel, "worker_count", lambda jobs: min(2, jobs))


def test_results_come_in_the_jobs_order() -> None:
    assert map_jobs(neg, [3, 1, 2], lambda job: job, "negating") == [-3, -1, -2]


def test_a_failing_job_fails_the_whole() -> None:
    with pytest.raises(TypeError):
        map_jobs(neg, [1, "two", 3], lambda job: 1, "negating")


def test_one_job_needs_no_process() -> None:
    assert map_jobs(lambda job: (job, os.getpid()), [7], lambda job: 1, "asking") == [(7, os.getpid())]


@pytest.mark.parametrize("workers", [1, 2])
def test_the_bar_advances_by_the_weight_of_each_job(workers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    progress = Progress(disable=True)
    monkeypatch.setattr(parallel, "worker_count", lambda jobs: workers)
    monkeypatch.setattr(parallel, "bar", lambda: progress)
    map_jobs(neg, [3, 1, 2], lambda job: job, "negating")
    (task,) = progress.tasks
    assert (task.completed, task.total) == (6, 6)


def test_threads_are_limited_only_for_children(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(THREAD_SETTINGS[0], "5")
    monkeypatch.delenv(THREAD_SETTINGS[1], raising=False)
    with single_threaded_children():
        assert {os.environ[name] for name in THREAD_SETTINGS} == {"1"}
    assert os.environ[THREAD_SETTINGS[0]] == "5"
    assert THREAD_SETTINGS[1] not in os.environ

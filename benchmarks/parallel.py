"""Jobs over the cores, one thread each, with a progress bar."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

Job = TypeVar("Job")
Result = TypeVar("Result")
MAX_WORKERS = 8
"""Processes at most: each holds the encoded bursts that it works on."""
THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def bar(disable: bool = False) -> Progress:
    """The progress bar of every benchmark, on a terminal only; it leaves no trace."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    return Progress(*columns, console=console, transient=True, disable=disable or not console.is_terminal)


def worker_count(jobs: int) -> int:
    """Processes that `map_jobs` starts for so many jobs."""
    return max(1, min(os.cpu_count() or 1, MAX_WORKERS, jobs))


def map_jobs(function: Callable[[Job], Result], jobs: Sequence[Job], weight: Callable[[Job], int], description: str) -> list[Result]:
    """`function` of every job, in the jobs' order; the bar advances by each job's `weight`. Errors pass through.

    One job alone runs in this process.
    """
    with single_threaded_children(), bar() as progress:
        task = progress.add_task(description, total=sum(weight(job) for job in jobs))
        if worker_count(len(jobs)) == 1:
            results = []
            for job in jobs:
                results.append(function(job))
                progress.advance(task, weight(job))
            return results
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(worker_count(len(jobs)), mp_context=context) as pool:
            futures = {pool.submit(function, job): job for job in jobs}
            try:
                for future in as_completed(futures):
                    future.result()
                    progress.advance(task, weight(futures[future]))
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
            return [future.result() for future in futures]


@contextmanager
def single_threaded_children() -> Iterator[None]:
    """Processes started inside have one thread each, so that they do not fight for the cores."""
    before = {name: os.environ.get(name) for name in THREAD_SETTINGS}
    os.environ.update(dict.fromkeys(THREAD_SETTINGS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value

"""Concurrent requests: a bounded queue, and passes of the backbone that are shared."""

from __future__ import annotations

import threading

import anyio
import numpy as np
import pytest
from fastapi.testclient import TestClient

from core.errors import Unavailable
from service.app import create_app
from service.batching import LARGEST_PASS, BatchingBackbone
from service.refusals import Busy
from service.work import WorkQueue
from tests.service.conftest import LONG_S, Gate, until


def images(seed, views=2, side=16):
    return np.random.default_rng(seed).integers(0, 255, (views, side, side, 3), dtype=np.uint8)


def together(batching, gate, stacks):
    """What each stack's features are, the first one's pass running while the others arrive."""
    found = [None] * len(stacks)

    def extract(index):
        try:
            found[index] = batching.extract(stacks[index])
        except Unavailable as error:
            found[index] = error

    threads = [threading.Thread(target=extract, args=(index,)) for index in range(len(stacks))]
    threads[0].start()
    gate.entered.wait(LONG_S)
    for thread in threads[1:]:
        thread.start()
    until(lambda: len(batching._waiting) == len(stacks) - 1)
    gate.open.set()
    for thread in threads:
        thread.join()
    return found


def test_what_waits_shares_a_pass_and_everyone_gets_their_own(backbone):
    gate, told = Gate(backbone), []
    stacks = [images(0), images(1, 3), images(2, 1)]
    found = together(BatchingBackbone(gate, told.append), gate, stacks)
    assert gate.passes == [2, 4] == told
    for stack, features in zip(stacks, found):
        alone = backbone.extract(stack)
        for name in ("patches", "cls", "attention", "saliency"):
            assert np.array_equal(getattr(features, name), getattr(alone, name))


def test_images_of_another_size_take_another_pass(backbone):
    gate = Gate(backbone)
    found = together(BatchingBackbone(gate), gate, [images(0), images(1), images(2, side=32)])
    assert sorted(gate.passes) == [2, 2, 2]
    assert found[2].patches.shape[1] == 8


def test_a_pass_has_a_largest_size(backbone):
    gate = Gate(backbone)
    together(BatchingBackbone(gate), gate, [images(0), images(1, LARGEST_PASS), images(2, LARGEST_PASS)])
    assert sorted(gate.passes) == [2, LARGEST_PASS, LARGEST_PASS]


class Choosy(Gate):
    """A backbone that fails where a pass has an image of white pixels only, or is larger than memory allows."""

    largest = LARGEST_PASS

    def extract(self, stack):
        found = super().extract(stack)
        if (stack == 255).all(axis=(1, 2, 3)).any():
            raise ValueError("NaN in layer 3")
        if len(stack) > self.largest:
            raise MemoryError("cannot allocate")
        return found


def test_a_request_that_the_backbone_fails_at_fails_no_other(backbone):
    gate = Choosy(backbone)
    batching = BatchingBackbone(gate)
    found = together(batching, gate, [images(0), np.full_like(images(1), 255), images(2)])
    assert [isinstance(each, Unavailable) for each in found] == [False, True, False]
    assert "colour failed (ValueError)" in str(found[1])
    assert np.array_equal(found[2].cls, backbone.extract(images(2)).cls)


def test_a_pass_that_memory_does_not_suffice_for_is_made_in_parts(backbone):
    gate, told = Choosy(backbone), []
    gate.largest = 3
    gate.open.set()
    batching = BatchingBackbone(gate, told.append)
    found = batching.extract(images(0, views=9))
    alone = backbone.extract(images(0, views=9))
    for name in ("patches", "cls", "attention", "saliency"):
        assert np.array_equal(getattr(found, name), getattr(alone, name))
    assert sum(told) == 9
    assert max(told) <= 3
    batching.require_sound()


def test_a_backbone_that_failed_is_unsound_until_it_works_again(backbone):
    gate = Choosy(backbone)
    gate.open.set()
    batching = BatchingBackbone(gate)
    gate.largest = 0
    with pytest.raises(Unavailable, match="MemoryError.*fewer views"):
        batching.extract(images(0))
    with pytest.raises(Unavailable, match="MemoryError"):
        batching.require_sound()
    gate.largest = LARGEST_PASS
    batching.require_sound()
    before = len(gate.passes)
    batching.require_sound()
    assert len(gate.passes) == before, "a sound backbone is not tried"


def test_who_comes_when_the_queue_is_full_is_sent_away():
    async def crowd():
        queue, release = WorkQueue(workers=1, queue=1), threading.Event()
        async with anyio.create_task_group() as tasks:
            for _ in range(2):
                tasks.start_soon(queue.run, release.wait)
            await anyio.wait_all_tasks_blocked()
            with pytest.raises(Busy, match="ONELOOK_QUEUE") as refused:
                await queue.run(release.wait)
            release.set()
        assert refused.value.retry_after_s >= 1
        assert queue.pending == 0
        assert await queue.run(lambda: 3) == 3

    anyio.run(crowd)


def test_a_full_queue_is_answered_503_with_the_time_to_wait(settings, backbone, look, parts):
    gate = Gate(backbone)
    small = settings.model_copy(update={"workers": 1, "queue": 0})
    with TestClient(create_app(small, backbone=gate)) as client:
        files, answers = parts(look()), []
        first = threading.Thread(target=lambda: answers.append(client.post("/v1/observations", files=files)))
        first.start()
        gate.entered.wait(LONG_S)
        refused = client.post("/v1/observations", files=files)
        alive = client.get("/healthz")
        gate.open.set()
        first.join()
    assert (refused.status_code, refused.json()["type"]) == (503, "urn:onelook:problem:unavailable")
    assert int(refused.headers["retry-after"]) >= 1
    assert (alive.status_code, answers[0].status_code) == (200, 201)


def test_requests_at_once_are_answered_as_one_by_one(client, look, parts, learn):
    learn()
    bursts = [parts(look(kind, views=views)) for kind in ("bright", "dark") for views in (3, 4)]
    asked = {"learn": False}
    alone = [client.post("/v1/observations", files=burst, params=asked).json() for burst in bursts]
    together = [None] * len(bursts)

    def ask(index):
        together[index] = client.post("/v1/observations", files=bursts[index], params=asked).json()

    threads = [threading.Thread(target=ask, args=(index,)) for index in range(len(bursts))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for one, other in zip(alone, together):
        assert one["outcome"] == other["outcome"]
        assert one["similarities"] == other["similarities"]
        assert (one["pose"] or {}).get("target_from_reference") == (other["pose"] or {}).get("target_from_reference")

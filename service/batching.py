"""Requests that come together share passes of the backbone."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from core.backbones.base import Backbone, Features
from core.encode import EncoderConfig
from core.errors import OneLookError, Unavailable
from service.cancelling import require_wanted
from service.refusals import CalledOff

Images = NDArray[np.uint8]
LARGEST_PASS = 64
"""Images of one pass: more would only make the first of them wait."""
LOOK_S = 0.1
"""How often who waits for a pass looks whether it is still wanted."""
CPU_ALLOCATOR = "can't allocate memory"
"""What torch's error says there, which is of no class of its own."""
HANGS = (
    "if this does not end, it hangs, and the service has to start anew: `onelook serve` ends by itself for that; "
    "with --cluster only encoders are replaced"
)
log = logging.getLogger("onelook")


@dataclass(eq=False)
class _Ticket:
    """Images that wait for a pass, and what came of them."""

    images: Images
    """Shape (V, S, S, 3)."""
    features: Features | None = None
    error: Exception | None = None

    @property
    def done(self) -> bool:
        return self.features is not None or self.error is not None


class BatchingBackbone:
    """A backbone for many threads: what waits while a pass runs goes into the next one together, so nobody waits for company.

    Within a pass, tokens may differ from those of a pass alone in their last bits. A pass that fails is repeated for each request alone, so
    that one cannot fail the others, and one that memory does not suffice for in halves.
    """

    def __init__(self, backbone: Backbone, on_pass: Callable[[int], None] = lambda images: None, deadline_s: float = math.inf) -> None:
        """`on_pass` is told the number of images of each pass; one that takes longer than `deadline_s` is not sound."""
        self.name = backbone.name
        self.patch_size = backbone.patch_size
        self.dim = backbone.dim
        self.has_saliency = backbone.has_saliency
        self.whitening = backbone.whitening
        self.fingerprint = backbone.fingerprint
        self._backbone = backbone
        self._on_pass = on_pass
        self._deadline_s = deadline_s
        self._waiting: list[_Ticket] = []
        self._waiting_lock = threading.Lock()
        self._pass_lock = threading.Lock()
        self._failed = False
        """The last pass."""
        self._began: float | None = None
        """The pass that runs."""

    def extract(self, images: Images) -> Features:
        """See `Backbone.extract`. Raises Unavailable where it fails, and CalledOff where nobody waits for it any more."""
        ticket = _Ticket(images)
        with self._waiting_lock:
            self._waiting.append(ticket)
        self._take_pass(ticket)
        try:
            if not ticket.done:  # else an earlier pass took it along
                self._run(self._company(ticket))
        finally:
            self._pass_lock.release()
        if ticket.error is not None:
            raise self._unavailable(ticket.error) from ticket.error
        assert ticket.features is not None
        return ticket.features

    def require_sound(self) -> None:
        """Raises Unavailable where the last pass failed and another one, of one image, still does, and where one takes longer than it may.

        One that runs is not waited for.
        """
        if (pass_s := self.pass_s()) > self._deadline_s:
            raise Unavailable(f"a pass of the backbone {self.name} has run for {pass_s:.0f} s, longer than a request may take; {HANGS}")
        if not self._failed or not self._pass_lock.acquire(blocking=False):
            return
        side = EncoderConfig().first_grid * self.patch_size
        try:
            self._passed(np.zeros((1, side, side, 3), np.uint8))
        except Exception as error:
            raise self._unavailable(error) from error
        finally:
            self._pass_lock.release()

    def pass_s(self) -> float:
        """For how long the pass that runs has done so; 0 where none does."""
        began = self._began
        return 0.0 if began is None else time.monotonic() - began

    def _take_pass(self, ticket: _Ticket) -> None:
        while not self._pass_lock.acquire(timeout=LOOK_S):
            try:
                require_wanted()
            except CalledOff:
                with self._waiting_lock:
                    self._waiting = [each for each in self._waiting if each is not ticket]
                raise

    def _company(self, ticket: _Ticket) -> list[_Ticket]:
        """What waits and has images of the same size, the ticket itself first, up to LARGEST_PASS images."""
        with self._waiting_lock:
            taken, images = [ticket], len(ticket.images)
            for other in self._waiting:
                fits = other.images.shape[1:] == ticket.images.shape[1:] and images + len(other.images) <= LARGEST_PASS
                if other is not ticket and fits:
                    taken.append(other)
                    images += len(other.images)
            self._waiting = [each for each in self._waiting if each not in taken]
        return taken

    def _run(self, tickets: list[_Ticket]) -> None:
        try:
            features = self._passed(np.concatenate([ticket.images for ticket in tickets]))
        except Exception as error:
            if len(tickets) == 1:
                tickets[0].error = error
            else:
                for ticket in tickets:
                    self._run([ticket])
            return
        start = 0
        for ticket in tickets:
            ticket.features = features.part(slice(start, start + len(ticket.images)))
            start += len(ticket.images)

    def _passed(self, images: Images) -> Features:
        self._began = time.monotonic()
        try:
            features = self._backbone.extract(images)
        except Exception as error:
            self._failed = True
            log.error("a pass of %d images failed", len(images), exc_info=error)
            if not _out_of_memory(error) or len(images) == 1:
                raise
            half = len(images) // 2
            return Features.joined([self._passed(images[:half]), self._passed(images[half:])])
        finally:
            self._began = None
        self._failed = False
        self._on_pass(len(images))
        return features

    def _unavailable(self, error: Exception) -> OneLookError:
        if isinstance(error, OneLookError):
            return error
        remedy = (
            "send fewer views, or give the service more memory" if _out_of_memory(error) else "the log says more; start the service again"
        )
        return Unavailable(f"the backbone {self.name} failed ({type(error).__name__}); {remedy}")


def _out_of_memory(error: Exception) -> bool:
    return isinstance(error, (MemoryError, torch.OutOfMemoryError)) or CPU_ALLOCATOR in str(error)

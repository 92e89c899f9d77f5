"""Requests that come together share passes of the backbone."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.backbones.base import Backbone, Features

Images = NDArray[np.uint8]
LARGEST_PASS = 64
"""Images of one pass: more would only make the first of them wait."""


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

    Within a pass, tokens may differ from those of a pass alone in their last bits.
    """

    def __init__(self, backbone: Backbone, on_pass: Callable[[int], None] = lambda images: None) -> None:
        """`on_pass` is told the number of images of each pass."""
        self.name = backbone.name
        self.patch_size = backbone.patch_size
        self.dim = backbone.dim
        self.has_saliency = backbone.has_saliency
        self.whitening = backbone.whitening
        self.fingerprint = backbone.fingerprint
        self._backbone = backbone
        self._on_pass = on_pass
        self._waiting: list[_Ticket] = []
        self._waiting_lock = threading.Lock()
        self._pass_lock = threading.Lock()

    def extract(self, images: Images) -> Features:
        """See `Backbone.extract`."""
        ticket = _Ticket(images)
        with self._waiting_lock:
            self._waiting.append(ticket)
        with self._pass_lock:
            if not ticket.done:  # else an earlier pass took it along
                self._run(self._company(ticket))
        if ticket.error is not None:
            raise ticket.error
        assert ticket.features is not None
        return ticket.features

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
            features = self._backbone.extract(np.concatenate([ticket.images for ticket in tickets]))
        except Exception as error:
            for ticket in tickets:
                ticket.error = error
            return
        self._on_pass(sum(len(ticket.images) for ticket in tickets))
        start = 0
        for ticket in tickets:
            ticket.features = _slice(features, slice(start, start + len(ticket.images)))
            start += len(ticket.images)


def _slice(features: Features, part: slice) -> Features:
    saliency = None if features.saliency is None else features.saliency[part]
    return Features(features.patches[part], features.cls[part], features.attention[part], saliency)

"""Wall time by stage, for answers and benches."""

from __future__ import annotations

import time


class StageClock:
    """`lap(name)` books the time since the last lap under `name`."""

    def __init__(self) -> None:
        self.stage_ms: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """Ends a stage."""
        now = time.perf_counter()
        self.stage_ms[stage] = self.stage_ms.get(stage, 0.0) + (now - self._last) * 1e3
        self._last = now

"""What the service counts for Prometheus, for whoever measures it without one."""

from __future__ import annotations

from collections import Counter

import httpx
from prometheus_client.parser import text_string_to_metric_families

from clients.calls.call import Call


def metrics() -> Call[dict[str, float]]:
    """Each sample's value, such as `onelook_work_waiting`, summed over its labels."""
    return Call("GET", "/metrics", _read)


def _read(response: httpx.Response) -> dict[str, float]:
    sums: Counter[str] = Counter()
    for family in text_string_to_metric_families(response.text):
        for sample in family.samples:
            sums[sample.name] += sample.value  # type: ignore[assignment]
    return dict(sums)

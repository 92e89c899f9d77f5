"""Figures for Prometheus count what happened."""

from __future__ import annotations

import re
from importlib.metadata import version

from prometheus_client.parser import text_string_to_metric_families


def figures(client):
    """Value by (sample, labels)."""
    answer = client.get("/metrics")
    assert answer.headers["content-type"].startswith("text/plain")
    return {
        (sample.name, *sorted(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def test_requests_are_counted_under_their_route(client, learn):
    category = learn()
    client.get(f"/v1/categories/{category['id']}")
    client.get("/v1/categories/nope")
    client.get("/nowhere")
    found = figures(client)
    route = ("route", "/v1/categories/{category_id}")
    assert found["onelook_requests_total", ("method", "GET"), route, ("status", "200")] == 1
    assert found["onelook_requests_total", ("method", "GET"), route, ("status", "404")] == 1
    assert not any(category["id"] in str(key) for key in found)


def test_observations_stages_passes_and_the_memory_are_counted(client, look, parts, learn):
    learn()
    client.post("/v1/observations", files=parts(look()))
    found = figures(client)
    assert found["onelook_observations_total", ("outcome", "novel")] == 1
    assert found["onelook_observations_total", ("outcome", "known")] == 1
    assert found["onelook_events_total", ("kind", "category_created")] == 1
    assert found["onelook_stage_seconds_count", ("stage", "total")] == 2
    assert found["onelook_backbone_pass_images_count",] >= 6
    assert found["onelook_memory_kept", ("kind", "categories")] == 1
    assert found["onelook_memory_kept", ("kind", "instances")] == 2
    assert found["onelook_memory_version",] > 0
    assert found["onelook_memory_bytes",] > 10_000
    assert found["onelook_scans", ("state", "completed")] == 1
    assert found["onelook_scans", ("state", "collecting")] == 0
    assert (found["onelook_work_running",], found["onelook_work_waiting",]) == (0, 0)
    assert found["onelook_work_wait_seconds_count",] == 4  # two observations, views and the end of a scan
    assert found["onelook_build_info", ("backbone", "colour"), ("version", version("onelook"))] == 1


def test_the_process_is_measured(client):
    assert figures(client)["process_resident_memory_bytes",] > 10_000_000


def test_what_may_happen_starts_at_zero(client):
    found = figures(client)
    assert {found["onelook_observations_total", ("outcome", each)] for each in ("known", "uncertain", "novel")} == {0}
    assert {found["onelook_work_refused_total", ("reason", each)] for each in ("full", "stopping")} == {0}


def test_names_follow_prometheus_conventions(client, learn):
    """Base units, a suffix for the unit and for counters; nothing is a time in milliseconds or a size in megabytes."""
    learn()
    families = list(text_string_to_metric_families(client.get("/metrics").text))
    for family in families:
        name = family.name
        assert name.startswith(("onelook_", "process_"))
        assert not re.search(r"(_ms|_milliseconds|_mb|_megabytes|_percent)$", name)
        assert family.documentation.endswith(".")
        if family.type == "counter":
            assert all(sample.name.endswith("_total") for sample in family.samples)
        if family.type == "histogram":
            assert name.endswith(("_seconds", "_images"))

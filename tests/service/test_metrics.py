"""Figures for Prometheus count what happened."""

from __future__ import annotations

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


def test_observations_stages_passes_and_the_memory(client, look, parts, learn):
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
    assert found["onelook_work_pending",] == 0

"""The dashboard asks for figures that there are, and Prometheus is set up to fetch them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from service.access import ACCESS, VIEWER

DOCKER = Path(__file__).parents[2] / "docker"
DASHBOARD = json.loads((DOCKER / "grafana" / "dashboards" / "onelook.json").read_text())
QUERIES = [(panel["title"], target["expr"]) for panel in DASHBOARD["panels"] for target in panel["targets"]]
NAME = re.compile(r"\b((?:onelook|process)_\w+)(?:\{([^}]*)\})?")


@pytest.fixture
def exposed(client, learn, look, parts):
    """Every sample's labels, by its name, of a service that has learnt and recognised something."""
    learn()
    client.post("/v1/observations", files=parts(look()))
    client.get("/v1/categories")
    families = text_string_to_metric_families(client.get("/metrics").text)
    found = {}
    for family in families:
        for sample in family.samples:
            found.setdefault(sample.name, []).append(sample.labels)
    return found


def test_every_query_is_of_figures_that_there_are(exposed):
    assert len(QUERIES) > 25
    for title, query in QUERIES:
        asked = NAME.findall(query)
        assert asked, title
        for name, selector in asked:
            assert name in exposed, f"{title}: no figure is called {name}"
            for label, comparison, value in re.findall(r'(\w+)(!?=)"([^"]*)"', selector):
                values = {labels.get(label) for labels in exposed[name]}
                assert (value in values) if comparison == "=" else (None not in values), f"{title}: {selector}"


def test_what_is_grouped_by_is_a_label(exposed):
    for title, query in QUERIES:
        (name, _) = NAME.findall(query)[0]
        for label in re.findall(r"by \(([^)]*)\)", query):
            for each in label.split(", "):
                assert each in exposed[name][0], f"{title}: {name} has no label {each}"


def test_every_figure_of_the_service_is_shown(exposed):
    shown = {name for _, query in QUERIES for name, _ in NAME.findall(query)}
    families = {re.sub(r"_(total|bucket|sum|count|created)$", "", name) for name in exposed if name.startswith("onelook_")}
    assert families == {re.sub(r"_(total|bucket|sum|count)$", "", name) for name in shown if name.startswith("onelook_")}


def test_panels_do_not_overlap():
    taken = set()
    for panel in DASHBOARD["panels"]:
        place = panel["gridPos"]
        assert place["x"] + place["w"] <= 24
        cells = {(x, y) for x in range(place["x"], place["x"] + place["w"]) for y in range(place["y"], place["y"] + place["h"])}
        assert not taken & cells, panel["title"]
        taken |= cells
    assert len({panel["id"] for panel in DASHBOARD["panels"]}) == len(DASHBOARD["panels"])


def test_the_dashboards_source_is_the_one_that_is_set_up():
    (source,) = yaml.safe_load((DOCKER / "grafana/provisioning/datasources/prometheus.yaml").read_text())["datasources"]
    assert {panel["datasource"]["uid"] for panel in DASHBOARD["panels"]} == {source["uid"]}
    compose = yaml.safe_load((DOCKER / "compose.yaml").read_text())
    assert source["url"] == "http://prometheus:9090"
    assert "prometheus" in compose["services"]
    (provider,) = yaml.safe_load((DOCKER / "grafana/provisioning/dashboards/onelook.yaml").read_text())["providers"]
    assert f"./grafana/dashboards:{provider['options']['path']}:ro" in compose["services"]["grafana"]["volumes"]


def test_prometheus_asks_the_service_with_a_viewers_key():
    (job,) = yaml.safe_load((DOCKER / "prometheus" / "prometheus.yaml").read_text())["scrape_configs"]
    compose = yaml.safe_load((DOCKER / "compose.yaml").read_text())
    (target,) = job["static_configs"][0]["targets"]
    host, port = target.split(":")
    assert host in compose["services"]
    assert compose["services"][host]["ports"] == [f"127.0.0.1:{port}:{port}"]
    secret = Path(job["authorization"]["credentials_file"]).name
    assert secret in compose["services"]["prometheus"]["secrets"]
    assert secret in compose["secrets"]
    assert ACCESS["metrics"] == VIEWER

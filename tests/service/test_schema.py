"""Whatever the schema allows, and what it does not, is answered as the schema says: never a 500, never an undocumented status."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import content_type_conformance, response_schema_conformance, status_code_conformance

from service.app import create_app
from service.settings import Settings

EXAMPLES = 5
"""Drawn for each operation, beside those that cover each constraint of its parameters."""
CHECKS = [not_a_server_error, status_code_conformance, content_type_conformance, response_schema_conformance]
STREAM = "/v1/events"
"""Never ends, so it is tested elsewhere."""
real: dict[str, str] = {}
"""Ids that there are, by the name of their path parameter."""
schema = schemathesis.openapi.from_dict(create_app(Settings()).openapi()).exclude(path=STREAM)


@schemathesis.serializer("application/x-npz", "application/zip")
def as_it_is(context: Any, value: Any) -> Any:
    """Bytes of no meaning, for bodies that are files."""
    return value if isinstance(value, bytes) else str(value).encode()


@schema.hook
def map_path_parameters(context: Any, path_parameters: dict[str, Any] | None) -> dict[str, Any] | None:
    """Every second id is one that there is."""
    if not path_parameters:
        return path_parameters
    return {name: real.get(name, value) if len(str(value)) % 2 else value for name, value in path_parameters.items()}


@pytest.fixture(scope="module")
def url(serving: Any, tmp_path_factory: Any, look: Any, parts: Any, colour_backbone: Any) -> Iterator[str]:
    """A live service that knows a category, an observation, a scan and a goal."""
    small = Settings(data_dir=tmp_path_factory.mktemp("schema") / "memory", max_views=12, max_upload_mb=8, variant="ucd", queue=0)
    with serving(small, colour_backbone) as address, httpx.Client(base_url=address, timeout=60) as client:
        seen = client.post("/v1/observations", files=parts(look())).json()
        client.post(f"/v1/scans/{seen['scan']['id']}/views", files=parts(look()))
        category = client.post(f"/v1/scans/{seen['scan']['id']}/complete").json()
        known = client.post("/v1/observations", files=parts(look(views=4)), params={"category_id": category["id"]}).json()
        goal = client.post(f"/v1/categories/{category['id']}/goals", json={"observation_id": known["id"]}).json()
        scan = client.post("/v1/scans", json={"observation_id": seen["id"]}).json()
        instance = client.get(f"/v1/categories/{category['id']}/instances").json()["instances"][1]
        client.patch(f"/v1/categories/{category['id']}", json={"name": "ball"})
        entry = client.get("/v1/memory/audit").json()["entries"][0]
        real.update(
            entry_id=entry["id"],
            category_id=category["id"],
            observation_id=known["id"],
            goal_id=goal["id"],
            scan_id=scan["id"],
            instance_id=instance["id"],
        )
        yield address


@schema.parametrize()
@settings(
    max_examples=EXAMPLES,
    derandomize=True,
    database=None,
    deadline=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=list(HealthCheck),
)
def test_every_answer_is_one_that_the_schema_knows(case: Any, url: str) -> None:
    response = case.call(base_url=url)
    case.validate_response(response, checks=CHECKS)

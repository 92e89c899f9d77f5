"""The configuration of a cluster is one that Ray Serve takes, of parts that there are. Ray is not started."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import yaml

from service.settings import Settings

DOCKER = Path(__file__).parents[2] / "docker"
COMPOSE = yaml.safe_load((DOCKER / "cluster" / "compose.yaml").read_text())
SERVE = DOCKER / "cluster" / "serve.yaml"
CHECK = """
import sys, yaml
from ray.serve.schema import ServeDeploySchema
from ray._common.utils import import_attr
schema = ServeDeploySchema.model_validate(yaml.safe_load(open(sys.argv[1])))
(application,) = schema.applications
made = import_attr(application.import_path)(application.args)
print(*sorted(each.name for each in application.deployments))
print(*sorted([made._bound_deployment.name, *(each._bound_deployment.name for each in made._bound_deployment.init_args[1:])]))
"""
"""In a process of its own: Ray warns of its own age when it is imported."""


def test_ray_serve_takes_it_and_its_parts_are_the_application_s(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", CHECK, str(SERVE)], capture_output=True, text=True, cwd=DOCKER.parent)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["Encoder MemoryOwner PoseSolver"] * 2


def test_its_settings_exist_and_one_owner_has_the_memory() -> None:
    configured = yaml.safe_load(SERVE.read_text())
    (application,) = configured["applications"]
    assert set(application["args"]) <= set(Settings.model_fields)
    owner, *others = application["deployments"]
    assert (owner["name"], owner["num_replicas"]) == ("MemoryOwner", 1)
    assert "autoscaling_config" not in owner
    (resource,) = owner["ray_actor_options"]["resources"]
    assert resource in COMPOSE["services"]["owner"]["command"][0]
    assert all("resources" not in each["ray_actor_options"] for each in others)


def test_containers_have_as_little_as_they_can() -> None:
    for service in COMPOSE["services"].values():
        assert service["cap_drop"] == ["ALL"]
        assert service["security_opt"] == ["no-new-privileges:true"]
        assert service["read_only"] is True
        assert all(port.startswith("127.0.0.1:") for port in service.get("ports", []))
        assert service["environment"]["RAY_AUTH_MODE"] == "token"
        assert service["environment"]["RAY_USAGE_STATS_ENABLED"] == "0"
    with_memory = [name for name, service in COMPOSE["services"].items() if any("memory:" in each for each in service.get("volumes", []))]
    assert with_memory == ["owner"]
    assert "/docker/cluster/secrets/" in (DOCKER.parent / ".gitignore").read_text().splitlines()


def test_the_page_makes_every_secret_that_the_containers_read() -> None:
    page = (DOCKER.parent / "docs" / "scale.md").read_text()
    made = [f"> docker/cluster/{secret['file'].removeprefix('./')}\n" for secret in COMPOSE["secrets"].values()]
    assert made
    assert all(each in page for each in made)

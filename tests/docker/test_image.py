"""The images, what runs them, and the systemd unit keep to what docs/operations.md promises of them.

No Docker is needed: the files are read. docker/rehearse.py carries the image's steps out.
"""

from __future__ import annotations

import configparser
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from service.settings import Settings

ROOT = Path(__file__).parents[2]
DOCKER = ROOT / "docker"
sys.path.insert(0, str(DOCKER))

from recipe import Step, lineage, read_recipe, settings  # noqa: E402

STAGES = read_recipe(DOCKER / "Dockerfile")
COMPOSE = yaml.safe_load((DOCKER / "compose.yaml").read_text())
SETTINGS = {f"ONELOOK_{name.upper()}" for name in Settings.model_fields} | {"ONELOOK_CACHE"}
TARGETS = pytest.mark.parametrize("target", ["cpu", "cuda"])


def last(target: str, name: str) -> Step:
    """The instruction of this kind that counts."""
    return next(step for stage in reversed(lineage(STAGES, target)) if (step := stage.last(name)) is not None)


def test_the_recipe_is_clean() -> None:
    hadolint = shutil.which("hadolint", path=str(Path(sys.executable).parent))
    done = subprocess.run([hadolint, str(DOCKER / "Dockerfile")], capture_output=True, text=True)
    assert done.stdout + done.stderr == ""


def test_the_cpu_is_what_is_built_where_nothing_is_said() -> None:
    assert list(STAGES)[-1] == "cpu"


@TARGETS
def test_what_runs_has_no_compiler_no_source_and_no_root(target: str) -> None:
    steps = [step for stage in lineage(STAGES, target) for step in stage.steps]
    assert all(step.text.startswith("--from=build-") for step in steps if step.name == "COPY")
    assert not [step for step in steps if step.name == "RUN" and "pip" in step.text]
    user, group = map(int, last(target, "USER").text.split(":"))
    assert user > 0
    assert group > 0


@TARGETS
def test_it_is_well_when_readyz_says_so(target: str) -> None:
    assert "http://127.0.0.1:8000/readyz" in last(target, "HEALTHCHECK").text
    assert last(target, "ENTRYPOINT").words + last(target, "CMD").words == ["onelook", "serve"]


@TARGETS
def test_its_settings_exist_and_keep_everything_in_the_volume(target: str) -> None:
    given = {name: value for name, value in settings(lineage(STAGES, target)).items() if name.startswith("ONELOOK_")}
    assert set(given) <= SETTINGS
    volume = last(target, "VOLUME").text
    assert all(given[name].startswith(f"{volume}/") for name in ("ONELOOK_DATA_DIR", "ONELOOK_BACKUP_DIR"))
    assert given.get("ONELOOK_DEVICE", "cpu") == target
    Settings(**{name.removeprefix("ONELOOK_").lower(): value for name, value in given.items() if name != "ONELOOK_CACHE"})


@TARGETS
def test_everything_is_installed_in_the_pinned_versions(target: str) -> None:
    build = lineage(STAGES, f"build-{target}")
    installs = [step.text for stage in build for step in stage.steps if step.name == "RUN" and "pip install" in step.text]
    assert len(installs) == 2
    assert all("--constraint constraints.txt" in each for each in installs)
    assert ('--no-deps --index-url "$TORCH_INDEX" torch' in installs[0]) == (target == "cpu")


def test_what_open3d_links_to_is_what_make_installs() -> None:
    (libraries,) = re.findall(r"^LIBRARIES := (.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert libraries in STAGES["base"].steps[0].text


def test_only_what_is_needed_goes_into_a_build() -> None:
    """The packages that an installation names, and nothing of the clone beside them: no memory, no keys, no recordings."""
    allowed = {line[1:] for line in (DOCKER / "Dockerfile.dockerignore").read_text().splitlines() if line.startswith("!")}
    assert all((ROOT / each).exists() for each in allowed)
    packages = {each.removesuffix("*") for each in re.findall(r'"(\w+\*)"', (ROOT / "pyproject.toml").read_text())}
    assert allowed == packages | {"pyproject.toml", "constraints.txt", "README.md", "LICENSE"}


@pytest.mark.parametrize("name", COMPOSE["services"])
def test_containers_have_as_little_as_they_can(name: str) -> None:
    service = COMPOSE["services"][name]
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert "privileged" not in service
    assert all(port.startswith("127.0.0.1:") for port in service.get("ports", []))
    assert re.fullmatch(r"onelook|[\w/]+:v?\d+\.\d+\.\d+", service["image"])


def test_the_service_writes_only_to_its_volume() -> None:
    service = COMPOSE["services"]["onelook"]
    assert service["read_only"] is True
    assert service["volumes"] == [f"memory:{last('cpu', 'VOLUME').text}"]
    assert service["tmpfs"] == ["/tmp"]


def test_files_and_volumes_that_compose_names_are_there() -> None:
    for service in COMPOSE["services"].values():
        for volume in service.get("volumes", []):
            source = volume.split(":")[0]
            assert (DOCKER / source).exists() if source.startswith("./") else source in COMPOSE["volumes"]
        assert set(service.get("secrets", [])) <= set(COMPOSE["secrets"])
    build = COMPOSE["services"]["onelook"]["build"]
    assert (DOCKER / build["context"] / build["dockerfile"]).is_file()
    assert build["target"] in STAGES
    assert yaml.safe_load((DOCKER / "compose.cuda.yaml").read_text())["services"]["onelook"]["build"]["target"] in STAGES


def test_secrets_are_never_added_to_the_repository() -> None:
    assert all(secret["file"].startswith("./secrets/") for secret in COMPOSE["secrets"].values())
    assert "/docker/secrets/" in (ROOT / ".gitignore").read_text().splitlines()


def test_a_container_gets_longer_to_stop_than_a_request_gets_to_be_answered() -> None:
    from service.server import GRACE_S

    longest_s = Settings().deadline_s + GRACE_S
    assert int(COMPOSE["services"]["onelook"]["stop_grace_period"].removesuffix("s")) > longest_s
    assert int(unit()["Service"]["TimeoutStopSec"]) > longest_s


def test_a_service_that_ended_itself_is_started_anew() -> None:
    service = unit()["Service"]
    assert service["Restart"] == "on-failure"  # which any exit code but 0 is
    assert not {"RestartPreventExitStatus", "SuccessExitStatus"} & set(service)
    assert COMPOSE["services"]["onelook"]["restart"] == "unless-stopped"


def unit() -> Any:
    """The systemd unit; of a name that comes twice the last value."""
    parser = configparser.ConfigParser(strict=False, interpolation=None)
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read(DOCKER / "systemd" / "onelook.service")
    return parser


def test_under_systemd_it_is_nobody_and_writes_nothing_but_its_state() -> None:
    service = unit()["Service"]
    assert service["User"] == "onelook"
    assert service["ProtectSystem"] == "strict"
    assert service["NoNewPrivileges"] == "yes"
    assert service["CapabilityBoundingSet"] == ""
    assert service["StateDirectory"] == "onelook"


def test_settings_of_the_unit_exist() -> None:
    text = (DOCKER / "systemd" / "onelook.service").read_text()
    named = set(re.findall(r"(ONELOOK_\w+)=", text))
    assert named
    assert named <= SETTINGS


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd here")
def test_systemd_understands_the_unit_and_finds_little_exposed() -> None:
    path = str(DOCKER / "systemd" / "onelook.service")
    done = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=20", path], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    verified = subprocess.run(["systemd-analyze", "verify", path], capture_output=True, text=True)
    assert [line for line in verified.stderr.splitlines() if "is not executable" not in line] == []

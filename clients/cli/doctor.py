"""`onelook doctor`: what keeps a service from running on this machine, and how to mend it."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.text import Text

from clients.cli.service import bound, read_settings, url_of
from clients.cli.terminal import Json, console, errors, print_json, print_table
from clients.errors import ClientError
from core.errors import InvalidInput, OneLookError

if TYPE_CHECKING:
    from core.backbones.base import Backbone
    from service.settings import Settings

PYTHONS = ((3, 10), (3, 14))
"""From the first, before the second."""
LIBRARIES = ("torch", "transformers", "onnx", "cv2", "fastapi", "uvicorn", "sqlite_utils")
SYSTEM_LIBRARIES = "libusb-1.0-0 libgl1 libegl1 libx11-6 libudev1 libidn2-0"
"""Debian's packages with what Open3D links to."""
LEAST_MEMORY_GB = 2.0
"""For torch, the backbone and a burst of ten views."""
LEAST_DISK_GB = 1.0
PROBE_S = 3.0
"""For an answer of the service that may have the port."""


class State(str, Enum):
    """How a check went."""

    good = "good"
    poor = "poor"
    """It works, but not well or not for long."""
    bad = "bad"
    """The service does not start."""


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    what: str
    state: State
    found: str
    remedy: str | None = None


def doctor(json: Json = False) -> None:
    """Check what the service needs: libraries, Open3D, weights, device, memory, disk, port. Exits with 1 where it would not start."""
    findings = []
    with errors.status("looking") as status:
        for finding in examine():
            findings.append(finding)
            status.update(Text(f"looking; {finding.what}: {finding.found}"))
    if json:
        print_json([asdict(finding) for finding in findings])
    else:
        print_table([_row(finding) for finding in findings], "nothing to look at")
        for finding in findings:
            if finding.remedy:
                console.print(Text.assemble("\n", (finding.what, "bold"), f": {finding.remedy}"), soft_wrap=True)
    if any(finding.state is State.bad for finding in findings):
        raise typer.Exit(1)


def examine() -> Iterator[Finding]:
    """Every finding, the cheap ones first; what needs a library that is missing is left out."""
    yield python()
    yield working_memory()
    found = libraries()
    yield found
    yield open3d()
    if found.state is State.bad:
        return
    try:
        settings = read_settings({})
        settings.require_consistent()
    except OneLookError as error:
        yield Finding("settings", State.bad, str(error), "set it right in the environment, or leave it out")
        return
    for check in (device, weights, memory, reach, disk, port):
        yield _guarded(check, settings)


def _guarded(check: Callable[[Settings], Finding], settings: Settings) -> Finding:
    """What a check found; an expected error is a finding too, whose sentence has its remedy."""
    try:
        return check(settings)
    except OneLookError as error:
        return Finding(check.__name__, State.bad, str(error))


def python() -> Finding:
    """The interpreter."""
    found = f"{sys.version_info.major}.{sys.version_info.minor}"
    if PYTHONS[0] <= sys.version_info[:2] < PYTHONS[1]:
        return Finding("python", State.good, found)
    return Finding("python", State.bad, found, "install Python 3.10 to 3.13, and OneLook in an environment of it")


def working_memory() -> Finding:
    """What the machine could give to a new process."""
    facts = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
    available_gb = int(facts["MemAvailable"].split()[0]) * 1024 / 1e9  # what it calls kB are 1024 bytes
    if available_gb >= LEAST_MEMORY_GB:
        return Finding("RAM", State.good, f"{available_gb:.1f} GB free")
    remedy = f"the service needs about {LEAST_MEMORY_GB:.0f} GB: stop other programs, or send fewer views (ONELOOK_MAX_VIEWS)"
    return Finding("RAM", State.poor, f"{available_gb:.1f} GB free", remedy)


def libraries() -> Finding:
    """Those of the service but Open3D."""
    reasons = {name: why for name in LIBRARIES if (why := _why_not(name))}
    if not reasons:
        return Finding("libraries", State.good, f"torch {import_module('torch').__version__}")
    missing = [name for name, why in reasons.items() if isinstance(why, ModuleNotFoundError)]
    if missing:
        return Finding("libraries", State.bad, f"{', '.join(missing)} missing", "run: pip install 'onelook[server]'")
    name, why = next(iter(reasons.items()))
    remedy = "install what it names with the system's packages, or run: pip install --force-reinstall 'onelook[server]'"
    return Finding("libraries", State.bad, f"{name} does not load: {why}", remedy)


def open3d() -> Finding:
    """Open3D, which links to system libraries that small installations lack."""
    why = _why_not("open3d")
    if why is None:
        return Finding("Open3D", State.good, str(import_module("open3d").__version__))
    if isinstance(why, ModuleNotFoundError):
        return Finding("Open3D", State.bad, "missing", "run: pip install 'onelook[server]'")
    return Finding("Open3D", State.bad, str(why), f"run: sudo apt-get install {SYSTEM_LIBRARIES}")


def device(settings: Settings) -> Finding:
    """The torch device of the backbone."""
    import torch

    try:
        torch.zeros(1, device=settings.device)
    except (RuntimeError, AssertionError) as error:  # torch asserts that it was built with CUDA
        reason = str(error).splitlines()[0]
        remedy = "set ONELOOK_DEVICE=cpu, or install a driver and a torch that fit the GPU"
        return Finding("device", State.bad, f"{settings.device}: {reason}", remedy)
    threads = f", {torch.get_num_threads()} threads" if settings.device == "cpu" else f", {torch.cuda.get_device_name(settings.device)}"
    return Finding("device", State.good, settings.device + threads)


def weights(settings: Settings) -> Finding:
    """The backbone's, where they are on this machine: loaded, to see that they are whole."""
    from core.backbones.weights import cache_folder

    loaded = _backbone_here(settings.backbone)
    if loaded is None:
        remedy = "the first start downloads 90 MB; without a network copy the cache folder of a machine that has them"
        return Finding("weights", State.poor, f"not in {cache_folder()} yet", remedy)
    return Finding("weights", State.good, f"{loaded.name}, fingerprint {loaded.fingerprint[:12]}")


def memory(settings: Settings) -> Finding:
    """What was learnt, and whether this backbone can go on with it."""
    from store.connection import DATABASE
    from store.memory import Memory

    if not (settings.data_dir / DATABASE).exists():
        place = _nearest_folder(settings.data_dir)
        if place.is_dir() and os.access(place, os.W_OK):
            return Finding("memory", State.good, f"none in {settings.data_dir} yet; the first start makes it")
        return Finding("memory", State.bad, f"{place} cannot be written", "name another folder with ONELOOK_DATA_DIR or --data-dir")
    with Memory.reading(settings.data_dir) as stored:
        made_with, fingerprint, count = stored.backbone, stored.fingerprint, len(stored.categories.all())
    loaded = _backbone_here(settings.backbone)
    same = made_with == settings.backbone if loaded is None else fingerprint == loaded.fingerprint
    if fingerprint is not None and not same:
        found = f"{settings.data_dir} was made with {made_with} (fingerprint {fingerprint[:12]}), which is not this {settings.backbone}"
        first = "" if made_with == settings.backbone else f"ONELOOK_BACKBONE={made_with}, or "
        remedy = f"set {first}another ONELOOK_DATA_DIR, or run: onelook memory reembed"
        return Finding("memory", State.bad, found, remedy)
    return Finding("memory", State.good, f"{count} categories in {settings.data_dir}; `onelook memory check` reads all of it")


def reach(settings: Settings) -> Finding:
    """Who can ask the service, and whether it asks them who they are."""
    from store.connection import DATABASE
    from store.memory import Memory

    keys = 0
    if (settings.data_dir / DATABASE).exists():
        with Memory.reading(settings.data_dir) as stored:
            keys = len(stored.keys.all())
    settings.require_safe(keys)
    return Finding("reach", State.good, f"{settings.host}, with {keys} keys" if keys else f"{settings.host}, without keys")


def disk(settings: Settings) -> Finding:
    """Room for the memory to grow."""
    free_gb = shutil.disk_usage(_nearest_folder(settings.data_dir)).free / 1e9
    if free_gb >= LEAST_DISK_GB:
        return Finding("disk", State.good, f"{free_gb:.1f} GB free")
    remedy = "make room, keep fewer observations (ONELOOK_KEEP_OBSERVATIONS), or name a folder on another disk (ONELOOK_DATA_DIR)"
    return Finding("disk", State.poor, f"{free_gb:.1f} GB free", remedy)


def port(settings: Settings) -> Finding:
    """Whether the service's port is free, or it is the service itself that has it."""
    from clients.exchange import Retry
    from clients.robot import RobotClient

    url = url_of(settings.host, settings.port)
    try:
        with bound(settings.host, settings.port):
            return Finding("port", State.good, f"{url} is free")
    except OSError as error:
        refused = error.strerror
    try:
        with RobotClient(url, timeout_s=PROBE_S, retry=Retry(attempts=1)) as robot:
            return Finding("port", State.good, f"{url}: OneLook {robot.info().version} answers")
    except (ClientError, InvalidInput):
        remedy = "stop what uses it, or choose another one with ONELOOK_PORT or --port (0 takes a free one)"
        return Finding("port", State.bad, f"{url}: {refused}", remedy)


@cache
def _backbone_here(name: str) -> Backbone | None:
    """The backbone, which takes long to load; None where its weights would first have to be fetched."""
    from core.backbones import EMBEDDED, load_backbone
    from core.backbones.weights import FOLDER_NAME, cache_folder

    if name == EMBEDDED and not (cache_folder() / FOLDER_NAME).is_dir():
        return None
    return load_backbone(name)


def _why_not(library: str) -> Exception | None:
    """Why a library cannot be imported; None where it can."""
    try:
        import_module(library)
    except (ImportError, OSError) as error:
        return error
    return None


def _nearest_folder(path: Path) -> Path:
    """The nearest folder above that is there."""
    return next(each for each in (path, *path.absolute().parents) if each.exists())


def _row(finding: Finding) -> dict[str, str | Text]:
    style = {State.good: "green", State.poor: "yellow", State.bad: "bold red"}[finding.state]
    return {"": Text(finding.state.value, style), "what": finding.what, "found": finding.found}

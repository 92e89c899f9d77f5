"""Carries out the Dockerfile's steps without Docker, and starts what they make as a container would be.

    sudo python3 docker/rehearse.py FOLDER [--target cpu] [--build-arg TORCH_INDEX=https://pypi.org/simple]

Each stage is a copy-on-write layer over this machine's root, which takes the place of the base image: it should be the Debian that the
image is made of, with its Python. /root, /home, /srv, /tmp, /mnt and the clone are hidden from the steps: they find what they copy.
At the end the service runs as the image's user, without capabilities, on a read-only root with an empty volume, in a network of its own:
it becomes healthy, is asked by a robot, and is stopped. FOLDER is made, on the disk, and takes about 6 GB; delete it afterwards.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from recipe import Stage, lineage, read_recipe, settings

ROOT = Path(__file__).resolve().parents[1]
HIDDEN = ("/root", "/home", "/srv", "/tmp", "/mnt", str(ROOT))
SAMPLE = ROOT / "tests" / "data" / "bursts" / "cup" / "cup_1"
HEALTHY_S = 240
DISK_BYTES = 24_000_000_000
"""Only what is written takes room."""
PATH = "/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin"


def say(line: str) -> None:
    """A line for people."""
    sys.stderr.write(f"{line}\n")


def call(*command: object, **options: object) -> str:
    """Output of a command; raises CalledProcessError."""
    done = subprocess.run([str(each) for each in command], check=True, text=True, stdout=subprocess.PIPE, **options)  # type: ignore[call-overload]
    return str(done.stdout)


class Layers:
    """The stages on disk: what each added, and all of it together."""

    def __init__(self, folder: Path, stages: dict[str, Stage]) -> None:
        self._folder = folder
        self._stages = stages

    def mount(self, name: str) -> Path:
        """The root of a stage as its steps see it."""
        layer = self._folder / name
        root = layer / "root"
        if os.path.ismount(root):
            return root
        for part in ("upper", "work", "root"):
            (layer / part).mkdir(parents=True, exist_ok=True)
        below = [str(self._folder / stage.name / "upper") for stage in reversed(lineage(self._stages, name)[:-1])]
        options = f"lowerdir={':'.join([*below, '/'])},upperdir={layer / 'upper'},workdir={layer / 'work'}"
        call("mount", "-t", "overlay", "overlay", "-o", options, root)
        for hidden in HIDDEN:
            if (root / hidden[1:]).is_dir():
                call("mount", "-t", "tmpfs", "-o", "mode=1777", "none", root / hidden[1:])
        for shared in ("/proc", "/dev", "/sys"):
            call("mount", "--rbind", shared, root / shared[1:])
        return root


def build(folder: Path, target: str, arguments: dict[str, str]) -> None:
    """Carries out what `target` needs, a stage once."""
    stages = read_recipe(ROOT / "docker" / "Dockerfile")
    layers, done = Layers(folder, stages), set()

    def make(name: str) -> None:
        for stage in lineage(stages, name):
            if stage.name in done:
                continue
            done.add(stage.name)
            for step in stage.steps:
                if step.name == "COPY" and step.words[0].startswith("--from="):
                    make(step.words[0].removeprefix("--from="))
            say(f"== stage {stage.name}, on {stage.base}")
            carry_out(stage, layers, lineage(stages, stage.name)[:-1], arguments)

    make(target)


def carry_out(stage: Stage, layers: Layers, before: list[Stage], arguments: dict[str, str]) -> None:
    """The steps of one stage, as root; each sees what those before it said."""
    root = layers.mount(stage.name)
    shell = {"PATH": PATH} | {name: value for name, value in os.environ.items() if name.startswith("PIP_")} | settings(before)
    folder = next((step.text for each in reversed(before) if (step := each.last("WORKDIR"))), "/")
    for step in stage.steps:
        say(f"{step.name} {step.text}")
        if step.name == "ARG":
            name, _, default = step.text.partition("=")
            shell[name] = arguments.get(name, default)
        elif step.name == "ENV":
            shell |= dict(each.split("=", 1) for each in step.words)
        elif step.name == "WORKDIR":
            folder = step.text
            (root / step.text[1:]).mkdir(parents=True, exist_ok=True)
        elif step.name == "RUN":
            call("/usr/sbin/chroot", root, "/bin/sh", "-ec", f"cd {shlex.quote(folder)}; {step.text}", env=shell)
        elif step.name == "COPY":
            copy(step.words, root, Path(folder), layers)


def copy(words: list[str], root: Path, folder: Path, layers: Layers) -> None:
    """From the clone, or from another stage."""
    source = ROOT
    if words[0].startswith("--from="):
        source = layers.mount(words.pop(0).removeprefix("--from="))
    *names, destination = words
    for name in names:
        target = root / str(folder / destination)[1:]
        if source == ROOT and name == ".":
            for allowed in context():
                copy_to(ROOT / allowed, target / allowed)
        else:
            origin = source / name.lstrip("/")
            copy_to(origin, target / name if destination.endswith("/") else target)


def context() -> list[str]:
    """What the clone gives to a build: the names that .dockerignore lets in."""
    return [line[1:] for line in (ROOT / "docker" / "Dockerfile.dockerignore").read_text().splitlines() if line.startswith("!")]


def copy_to(origin: Path, target: Path) -> None:
    """A file or a folder."""
    target.parent.mkdir(parents=True, exist_ok=True)
    if origin.is_dir():
        shutil.copytree(origin, target, symlinks=True, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    else:
        shutil.copy2(origin, target)


def serve(folder: Path, target: str) -> None:
    """Starts the image as compose.yaml does, and asks it."""
    stages = read_recipe(ROOT / "docker" / "Dockerfile")
    line = lineage(stages, target)
    last = {
        name: next(step for stage in reversed(line) if (step := stage.last(name))) for name in ("USER", "ENTRYPOINT", "CMD", "HEALTHCHECK")
    }
    root, environment = Layers(folder, stages).mount(target), settings(line)
    call("ip", "link", "set", "lo", "up")
    volume = folder / "volume"
    shutil.rmtree(volume, ignore_errors=True)
    image = root / "var/lib/onelook"
    volume.mkdir(mode=0o700)
    os.chown(volume, image.stat().st_uid, image.stat().st_gid)
    shutil.copytree(SAMPLE, root / "tmp" / "cup")
    call("mount", "--bind", volume, image)
    call("mount", "-o", "remount,ro", root)
    user, _, group = last["USER"].text.partition(":")
    drop = ["setpriv", "--reuid", user, "--regid", group, "--clear-groups", "--no-new-privs", "--bounding-set=-all", "--inh-caps=-all"]

    def inside(*command: str, **more: str) -> list[str]:
        names = [f"{name}={value}" for name, value in {**environment, **more}.items()]
        return ["/usr/sbin/chroot", str(root), *drop, "env", "-i", "-C", "/tmp", *names, *command]

    onelook = last["ENTRYPOINT"].words
    refused = subprocess.run(inside(*onelook, *last["CMD"].words), text=True, stderr=subprocess.PIPE)
    require("nobody has a key" in refused.stderr, f"without a key it does not start: {refused.stderr.strip().splitlines()[-1]}")
    key = json.loads(call(*inside(*onelook, "keys", "create", "rehearsal", "--role", "admin", "--json")))["key"]
    with (folder / "service.log").open("w") as log, subprocess.Popen(inside(*onelook, *last["CMD"].words), stderr=log) as service:
        try:
            check = last["HEALTHCHECK"].text.partition("CMD ")[2]
            wait_healthy(inside(*json.loads(check)), service)
            seen = json.loads(call(*inside(*onelook, "observe", "/tmp/cup", "--json", ONELOOK_API_KEY=key)))
            require(seen["outcome"] == "novel", f"a robot asks about a cup: {seen['outcome']}")
            written = subprocess.run(inside("touch", "/opt/onelook/x"), text=True, stderr=subprocess.PIPE)
            require("Read-only" in written.stderr, f"nothing else can be written: {written.stderr.strip()}")
            status = Path(f"/proc/{service.pid}/status").read_text()
            require("CapEff:\t0000000000000000" in status, "it has no capabilities")
            require(f"Uid:\t{user}\t" in status, f"it runs as {user}")
        finally:
            service.send_signal(signal.SIGTERM)
        require(service.wait(60) in (0, -signal.SIGTERM), "it stops when it is told to")
    say((folder / "service.log").read_text())


def wait_healthy(check: list[str], service: subprocess.Popen[bytes]) -> None:
    """Returns once the image's own check says so."""
    started = time.monotonic()
    while subprocess.run(check, stderr=subprocess.DEVNULL).returncode:
        if service.poll() is not None or time.monotonic() - started > HEALTHY_S:
            require(False, "it becomes healthy")
        time.sleep(1)
    require(True, f"it is healthy after {time.monotonic() - started:.0f} s")


def require(holds: bool, what: str) -> None:
    """Says what holds; ends where it does not."""
    say(f"{'ok' if holds else 'FAILED'}: {what}")
    if not holds:
        raise SystemExit(1)


def main() -> None:
    """In mounts of its own, which end with it; the service without a network."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--target", default="cpu", choices=("cpu", "cuda"))
    parser.add_argument("--build-arg", action="append", default=[])
    parser.add_argument("--phase", choices=("build", "serve"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    folder = options.folder.resolve()
    if options.phase == "build":
        with (folder / "disk").open("w") as disk:  # layers cannot be within the layer below them, this machine's root
            disk.truncate(DISK_BYTES)
        call("mkfs.ext4", "-q", folder / "disk")
        (folder / "layers").mkdir()
        call("mount", "-o", "loop", folder / "disk", folder / "layers")
        build(folder / "layers", options.target, dict(each.split("=", 1) for each in options.build_arg))
        phase(["--net"], "serve")
    elif options.phase == "serve":
        serve(folder / "layers", options.target)
        say("rehearsed: the steps make a service that starts as a container would")
    else:
        folder.mkdir(parents=True)
        phase(["--mount"], "build")


def phase(apart: list[str], name: str) -> None:
    """This program again, in spaces of its own; ends as it does."""
    done = subprocess.run(["unshare", *apart, sys.executable, *sys.argv, "--phase", name])
    if done.returncode:
        raise SystemExit(done.returncode)


if __name__ == "__main__":
    main()

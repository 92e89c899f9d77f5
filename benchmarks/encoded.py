"""Every burst of a data folder, encoded once and kept in the user's cache.

A cached file is named by what it depends on: the sequence's images, depth and cameras, the backbone's fingerprint, the
encoder's configuration, and the source of the code that encodes. It is plain arrays (npz), never pickled.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

import core
from benchmarks.parallel import bar
from clients.datasets import folders
from core.crop import Window
from core.encode import EncodedBurst, EncodedView, Encoder
from core.views import Camera

ARRAYS = ("cells", "descriptors", "points_m", "saliency", "cls")
"""Fields of an EncodedView that are one array each."""
SOURCES = ("views.py", "encode.py", "crop.py", "depth.py", "foreground.py", "backbones/*.py")
"""Files of core/ that decide what an encoding is: a changed method never meets an old cache."""


def cache_folder() -> Path:
    """Where encoded bursts are kept: `encoded/` in `ONELOOK_CACHE`, or in the user's cache."""
    return Path(os.environ.get("ONELOOK_CACHE") or platformdirs.user_cache_path("onelook")) / "encoded"


def encode_all(sequences: Sequence[folders.Sequence], encoder: Encoder, folder: Path | None = None) -> list[Path]:
    """The cached file of every sequence, all its views, encoding those that have none, with a progress bar.

    Args:
        folder: where the files are kept; `cache_folder()` where None.

    Raises NoObject where a sequence has no view with an object.
    """
    files = [(folder or cache_folder()) / f"{_key(sequence, encoder)}.npz" for sequence in sequences]
    missing = [(sequence, file) for sequence, file in zip(sequences, files, strict=True) if not file.exists()]
    with bar(disable=not missing) as progress:
        task = progress.add_task("encoding", total=len(missing))
        for sequence, file in missing:
            progress.update(task, description=f"encoding {sequence.name}")
            _write(file, encoder.encode(folders.load_burst(sequence)))
            progress.advance(task)
    return files


def read_encoded(file: Path) -> EncodedBurst:
    """What `encode_all` kept in `file`."""
    with np.load(file, allow_pickle=False) as arrays:
        views = tuple(_read_view(arrays, f"{index}/") for index in range(int(arrays["views"])))
        stage_ms = dict(zip(arrays["stages"].tolist(), arrays["stage_ms"].tolist(), strict=True))
        return EncodedBurst(views, str(arrays["fingerprint"]), stage_ms)


def _key(sequence: folders.Sequence, encoder: Encoder) -> str:
    digest = hashlib.sha256(f"{encoder.backbone.fingerprint} {encoder.config} {_code_hash()}".encode())
    files = [*sequence.images, *sorted((sequence.path / "depth").glob("*.png")), sequence.path / "scene_camera.json"]
    for file in files:
        if file.exists():
            digest.update(f"{file.relative_to(sequence.path)}\0".encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()[:32]


@cache
def _code_hash() -> str:
    root = Path(core.__file__).parent
    sources = [source for pattern in SOURCES for source in sorted(root.glob(pattern))]
    return hashlib.sha256(b"\0".join(source.read_bytes() for source in sources)).hexdigest()


def _write(file: Path, encoded: EncodedBurst) -> None:
    arrays: dict[str, NDArray[Any]] = {
        "views": np.array(len(encoded.views)),
        "fingerprint": np.array(encoded.fingerprint),
        "stages": np.array(list(encoded.stage_ms), dtype=np.str_),
        "stage_ms": np.array(list(encoded.stage_ms.values()), dtype=float),
    }
    for index, view in enumerate(encoded.views):
        arrays |= {f"{index}/{name}": array for name, array in _view_arrays(view).items()}
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_suffix(f".{os.getpid()}.partial")
    with partial.open("wb") as stream:
        np.savez(stream, allow_pickle=False, **arrays)
    partial.replace(file)


def _view_arrays(view: EncodedView) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {name: getattr(view, name) for name in ARRAYS}
    arrays["window"] = np.array([view.window.x0, view.window.y0, view.window.size])
    arrays["grid"] = np.array(view.grid)
    if view.camera is not None:
        arrays |= {"K": view.camera.K, "world_from_camera": view.camera.world_from_camera}
    return arrays


def _read_view(arrays: Mapping[str, NDArray[Any]], prefix: str) -> EncodedView:
    camera = Camera(arrays[f"{prefix}K"], arrays[f"{prefix}world_from_camera"]) if f"{prefix}K" in arrays else None
    window = Window(*arrays[f"{prefix}window"].tolist())
    fields: dict[str, Any] = {name: arrays[prefix + name] for name in ARRAYS}
    return EncodedView(grid=int(arrays[f"{prefix}grid"]), window=window, camera=camera, **fields)

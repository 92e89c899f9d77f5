"""DINO-family backbones by transformers: the embedded DINOv2 ViT-S/14, and any DINO or DINOv2 folder or hub name."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from transformers import AutoModel
from transformers.utils import logging as transformers_logging

from core.backbones.base import Features
from core.backbones.saliency import SaliencyDecoder
from core.backbones.weights import SALIENCY_FILE, Report, embedded_weights
from core.backbones.whitening import Whitening
from core.errors import Unavailable

IMAGENET_MEAN = (0.485, 0.456, 0.406)
IMAGENET_DEVIATION = (0.229, 0.224, 0.225)
PREPROCESSING = "rgb-imagenet-1"
EMBEDDED = "dinov2-s14"
HUB_NAMES = {"dino-s8": "facebook/dino-vits8"}
MATCHING_LAYER = 9
"""Block, counted from 0, whose tokens serve as descriptors. The embedded weights' last block was fine-tuned for
saliency; block 9 of 12 matched best across instances, and serves the paper's DINO as well (Amir et al. 2021)."""


class DinoBackbone:
    """A frozen ViT of the DINO family behind the `Backbone` protocol."""

    def __init__(
        self,
        model: Any,
        name: str,
        *,
        layer: int = MATCHING_LAYER,
        decoder: SaliencyDecoder | None = None,
        whitening: Whitening | None = None,
        device: str = "cpu",
        dtype: torch.dtype = torch.float32,
        batch: int = 8,
    ) -> None:
        config = model.config
        self.name = name
        self.patch_size: int = config.patch_size
        self.dim: int = config.hidden_size
        self.has_saliency = decoder is not None
        self.whitening = whitening
        self._heads: int = config.num_attention_heads
        self._prefix = 1 + getattr(config, "num_register_tokens", 0)
        self._model: Any = model.eval().requires_grad_(False).to(device)
        self._decoder = decoder.eval().requires_grad_(False).to(device) if decoder else None
        self._blocks = _blocks(model)
        self._layer, self._device, self._dtype, self._batch = min(layer, len(self._blocks) - 1), device, dtype, batch
        self.fingerprint = _fingerprint([model, decoder], whitening, f"{PREPROCESSING}:layer{self._layer}:{dtype}")

    def extract(self, images: NDArray[np.uint8]) -> Features:
        """See `Backbone.extract`."""
        parts = [self._forward(images[start : start + self._batch]) for start in range(0, len(images), self._batch)]
        patches, cls, attention = (np.concatenate([part[key] for part in parts]) for key in ("patches", "cls", "attention"))
        saliency = np.concatenate([part["saliency"] for part in parts]) if self._decoder else None
        return Features(patches, cls, attention, saliency)

    @torch.inference_mode()
    def _forward(self, images: NDArray[np.uint8]) -> dict[str, NDArray[np.float32]]:
        pixels = torch.from_numpy(np.ascontiguousarray(images)).to(self._device).permute(0, 3, 1, 2).float() / 255
        mean, deviation = (torch.tensor(value, device=self._device).view(1, 3, 1, 1) for value in (IMAGENET_MEAN, IMAGENET_DEVIATION))
        pixels = (pixels - mean) / deviation
        caught: dict[str, Tensor] = {}
        attention: Any = self._blocks[-1].attention
        hooks = [
            attention.q_proj.register_forward_hook(_keep(caught, "query")),
            attention.k_proj.register_forward_hook(_keep(caught, "key")),
            self._blocks[self._layer].register_forward_hook(_keep(caught, "tokens")),
        ]
        try:
            with torch.autocast(torch.device(self._device).type, self._dtype, enabled=self._dtype != torch.float32):
                tokens = self._run(pixels)
        finally:
            for hook in hooks:
                hook.remove()
        side = pixels.shape[-1] // self.patch_size
        patches = caught["tokens"][:, self._prefix :].float().reshape(-1, side, side, self.dim)
        result = {"patches": patches, "cls": tokens[:, 0].float(), "attention": self._cls_attention(caught).reshape(-1, side, side)}
        if self._decoder:
            normalised = tokens[:, self._prefix :].float().transpose(1, 2).reshape(-1, self.dim, side, side)
            result["saliency"] = self._decoder(normalised, pixels.shape[-1])
        return {key: value.cpu().numpy() for key, value in result.items()}

    def _run(self, pixels: Tensor) -> Tensor:
        extra = {} if self._model.config.model_type.startswith("dinov2") else {"interpolate_pos_encoding": True}
        output: Tensor = self._model(pixel_values=pixels, **extra).last_hidden_state
        return output

    def _cls_attention(self, caught: dict[str, Tensor]) -> Tensor:
        """Attention from [CLS] to the patches in the last block, mean over heads, maximum 1, shape (V, G²)."""
        query, key = (caught[name].float().reshape(*caught[name].shape[:2], self._heads, -1) for name in ("query", "key"))
        logits = torch.einsum("vhd,vthd->vht", query[:, 0], key) * (self.dim // self._heads) ** -0.5
        attention: Tensor = logits.softmax(dim=-1)[:, :, self._prefix :].mean(dim=1)
        return torch.div(attention, attention.amax(dim=1, keepdim=True))


def load_backbone(
    name: str = EMBEDDED,
    *,
    device: str = "cpu",
    dtype: torch.dtype = torch.float32,
    layer: int = MATCHING_LAYER,
    report: Report = lambda message: None,
) -> DinoBackbone:
    """A backbone by name (`dinov2-s14`, `dino-s8`), by folder in the hub's layout, or by hub name.

    Raises Unavailable, naming the remedy, when the weights are not there and cannot be fetched.
    """
    source: str | Path = embedded_weights(report=report) if name == EMBEDDED else HUB_NAMES.get(name, name)
    transformers_logging.disable_progress_bar()  # type: ignore[no-untyped-call]
    try:
        model = AutoModel.from_pretrained(source, attn_implementation="sdpa", dtype=torch.float32)
    except (OSError, ValueError) as error:
        raise Unavailable(f"backbone {name!r} could not be loaded from {source}: give a folder with config.json and weights") from error
    decoder_file = Path(source) / SALIENCY_FILE
    decoder = SaliencyDecoder.load(decoder_file) if decoder_file.exists() else None
    whitening = Whitening.shipped(name) if layer == MATCHING_LAYER else None
    return DinoBackbone(model, name, layer=layer, decoder=decoder, whitening=whitening, device=device, dtype=dtype)


def _blocks(model: Any) -> nn.ModuleList:
    for module in model.modules():
        if isinstance(module, nn.ModuleList):
            return module
    raise Unavailable(f"{type(model).__name__} has no list of transformer blocks: not a ViT")


def _keep(caught: dict[str, Tensor], name: str) -> Callable[[nn.Module, Any, Any], None]:
    def hook(module: nn.Module, inputs: Any, output: Any) -> None:
        caught[name] = output[0] if isinstance(output, tuple) else output

    return hook


def _fingerprint(parts: list[nn.Module | None], whitening: Whitening | None, preprocessing: str) -> str:
    digest = hashlib.sha256(preprocessing.encode())
    for part in parts:
        for name, tensor in sorted(part.state_dict().items() if part else ()):
            digest.update(name.encode())
            digest.update(tensor.cpu().numpy().tobytes())
    if whitening:
        digest.update(whitening.mean.tobytes() + whitening.matrix.tobytes())
    return digest.hexdigest()[:16]

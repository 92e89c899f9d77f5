"""DINO-family backbones by transformers: the embedded DINOv2 ViT-S/14, and any DINO or DINOv2 folder or hub name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from transformers import AttentionInterface, AutoModel
from transformers.utils import logging as transformers_logging

from core.backbones import EMBEDDED
from core.backbones.base import Backbone, Features, Load, Report, fingerprint, shown_patches
from core.backbones.saliency import SaliencyDecoder
from core.backbones.weights import SALIENCY_FILE, embedded_weights
from core.backbones.whitening import Whitening
from core.errors import Unavailable

IMAGENET_MEAN = (0.485, 0.456, 0.406)
IMAGENET_DEVIATION = (0.229, 0.224, 0.225)
PREPROCESSING = "rgb-imagenet-1"
"""Part of the fingerprint; to be changed whenever pixels reach the network otherwise, which makes other tokens of the same image."""
MATCHING_LAYER = 9
"""Block, counted from 0, whose tokens serve as descriptors. The embedded weights' last block was fine-tuned for
saliency; block 9 of 12 matched best across instances, and serves the paper's DINO as well (Amir et al. 2021)."""
BATCH = 8
"""Images that share a pass, where nothing else is said."""
CACHED_TOKENS = 2400
"""Of a pass on a CPU: what lies between two layers then stays in the processor's cache, and a pass takes a quarter less."""
PRODUCTS = "onelook_products"
"""Name of `_attend` among transformers' ways to attend."""


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
        batch: int = BATCH,
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
        self.fingerprint = fingerprint([model, decoder] if decoder else [model], whitening, f"{PREPROCESSING}:layer{self._layer}")
        for module in self._blocks.modules():
            if isinstance(module, nn.Linear):
                module.to(dtype)  # once, rather than in every pass

    def extract(self, images: NDArray[np.uint8]) -> Features:
        """See `Backbone.extract`. Images that show as many patches share passes of up to `batch`; large ones share less on a CPU."""
        grid = images.shape[1] // self.patch_size
        shown = shown_patches(images, self.patch_size)
        counts = shown.sum(axis=1)
        features = Features(
            np.zeros((len(images), grid, grid, self.dim), np.float32),
            np.zeros((len(images), self.dim), np.float32),
            np.zeros((len(images), grid, grid), np.float32),
            np.zeros(images.shape[:3], np.float32) if self._decoder else None,
        )
        for count in np.unique(counts[counts > 0]):
            alike = np.flatnonzero(counts == count)
            for places in passes(len(alike), self._prefix + int(count), self._device, self._batch):
                part = alike[places]
                self._forward(images[part, :, :, :3], shown[part], features, part)
        return features

    @torch.inference_mode()
    def _forward(self, images: NDArray[np.uint8], shown: NDArray[np.bool_], into: Features, rows: NDArray[np.intp]) -> None:
        """Features of images that show as many patches each, written to their rows."""
        pixels = torch.from_numpy(np.ascontiguousarray(images)).to(self._device).permute(0, 3, 1, 2).float() / 255
        mean, deviation = (torch.tensor(value, device=self._device).view(1, 3, 1, 1) for value in (IMAGENET_MEAN, IMAGENET_DEVIATION))
        caught: dict[str, Tensor] = {}
        attention: Any = self._blocks[-1].attention
        hooks = [getattr(attention, f"{name}_proj").register_forward_hook(_keep(caught, name)) for name in ("q", "k")]
        try:
            with torch.autocast(torch.device(self._device).type, self._dtype, enabled=self._dtype != torch.float32):
                tokens, last = self._run((pixels - mean) / deviation, shown)
                result = {"patches": tokens[:, self._prefix :], "cls": last[:, 0], "attention": self._cls_attention(caught)}
                if self._decoder:
                    grid = torch.zeros(len(shown), self.dim, shown.shape[1], dtype=last.dtype, device=last.device)
                    grid.transpose(1, 2)[torch.from_numpy(shown)] = last[:, self._prefix :].flatten(0, 1)
                    side = pixels.shape[-1] // self.patch_size
                    result["saliency"] = self._decoder(grid.reshape(-1, self.dim, side, side), pixels.shape[-1])
        finally:
            for hook in hooks:
                hook.remove()
        found = {name: value.float().cpu().numpy() for name, value in result.items()}
        where = shown.reshape(-1, *into.attention.shape[1:])
        image, row, column = np.nonzero(where)
        into.patches[rows[image], row, column] = found["patches"].reshape(-1, self.dim)
        into.attention[rows[image], row, column] = found["attention"].ravel()
        into.cls[rows] = found["cls"]
        if into.saliency is not None:
            into.saliency[rows] = found["saliency"] * where.repeat(self.patch_size, axis=1).repeat(self.patch_size, axis=2)

    def _run(self, pixels: Tensor, shown: NDArray[np.bool_]) -> tuple[Tensor, Tensor]:
        """Tokens of the matching layer, and the last ones after their LayerNorm, of the patches that are shown."""
        extra = {} if self._model.config.model_type.startswith("dinov2") else {"interpolate_pos_encoding": True}
        hidden = self._model.embeddings(pixels, **extra)
        if not shown.all():
            kept = np.pad(shown, ((0, 0), (self._prefix, 0)), constant_values=True)
            hidden = hidden[torch.from_numpy(kept)].reshape(len(shown), -1, self.dim)
        tokens = hidden
        for index, block in enumerate(self._blocks):
            hidden = block(hidden)
            if index == self._layer:
                tokens = hidden
        return tokens, self._model.layernorm(hidden)

    def _cls_attention(self, caught: dict[str, Tensor]) -> Tensor:
        """Attention from [CLS] to the patches in the last block, mean over heads, maximum 1, shape (V, patches shown)."""
        query, key = (caught[name].float().reshape(*caught[name].shape[:2], self._heads, -1) for name in ("q", "k"))
        logits = torch.einsum("vhd,vthd->vht", query[:, 0], key) * (self.dim // self._heads) ** -0.5
        attention: Tensor = logits.softmax(dim=-1)[:, :, self._prefix :].mean(dim=1)
        return torch.div(attention, attention.amax(dim=1, keepdim=True))


def passes(images: int, tokens: int, device: str, batch: int = BATCH) -> list[NDArray[np.intp]]:
    """Which of so many images, of so many tokens each, share a pass: their indices, one array a pass.

    Up to `batch`, and on a CPU no more than its cache holds.
    """
    together = min(batch, max(1, CACHED_TOKENS // tokens)) if torch.device(device).type == "cpu" else batch
    return np.array_split(np.arange(images), -(-images // together))


def fast_dtype(device: str) -> torch.dtype:
    """bfloat16 where the device multiplies it natively, else float32. Tokens of the two have a cosine of 0.9999."""
    if torch.device(device).type == "cuda":
        native = torch.cuda.is_bf16_supported(including_emulation=False)
    else:
        native = any(torch.cpu.get_capabilities().get(name) for name in ("avx512_bf16", "amx_bf16"))
    return torch.bfloat16 if native else torch.float32


def load(
    source: str | Path, name: str, *, device: str = "cpu", dtype: torch.dtype | None = None, layer: int = MATCHING_LAYER
) -> DinoBackbone:
    """Any of the family, from a folder in the hub's layout or by hub name, to be called `name`.

    `dtype` is of the products, `fast_dtype(device)` where left out.

    Raises Unavailable where that cannot be loaded, or is no ViT.
    """
    dtype = fast_dtype(device) if dtype is None else dtype
    attention = PRODUCTS if torch.device(device).type == "cpu" and dtype != torch.float32 else "sdpa"  # fused is slow there
    transformers_logging.disable_progress_bar()  # type: ignore[no-untyped-call]
    try:
        model = AutoModel.from_pretrained(source, attn_implementation=attention, dtype=torch.float32)
    except (OSError, ValueError) as error:
        raise Unavailable(f"backbone {name!r} could not be loaded from {source}: give a folder with config.json and weights") from error
    decoder_file = Path(source) / SALIENCY_FILE
    decoder = SaliencyDecoder.load(decoder_file) if decoder_file.exists() else None
    whitening = Whitening.shipped(name) if layer == MATCHING_LAYER else None
    return DinoBackbone(model, name, layer=layer, decoder=decoder, whitening=whitening, device=device, dtype=dtype)


def _embedded(*, device: str, dtype: torch.dtype | None, report: Report) -> Backbone:
    return load(embedded_weights(report=report), EMBEDDED, device=device, dtype=dtype)


def _dino_s8(*, device: str, dtype: torch.dtype | None, report: Report) -> Backbone:
    return load("facebook/dino-vits8", "dino-s8", device=device, dtype=dtype)


def _attend(
    module: nn.Module, query: Tensor, key: Tensor, value: Tensor, mask: Tensor | None, scaling: float, **options: Any
) -> tuple[Tensor, None]:
    """Attention as two products, unmasked, of query, key and value (V, heads, T, D / heads); the scale goes to the smallest of them."""
    weights = (query * scaling) @ key.transpose(2, 3)
    return (weights.softmax(dim=-1) @ value).transpose(1, 2).contiguous(), None


AttentionInterface.register(PRODUCTS, _attend)


def _blocks(model: Any) -> nn.ModuleList:
    for module in model.modules():
        if isinstance(module, nn.ModuleList):
            return module
    raise Unavailable(f"{type(model).__name__} has no list of transformer blocks: not a ViT")


def _keep(caught: dict[str, Tensor], name: str) -> Callable[[nn.Module, Any, Any], None]:
    def hook(module: nn.Module, inputs: Any, output: Any) -> None:
        caught[name] = output

    return hook


OFFERS: Mapping[str, Load] = {EMBEDDED: _embedded, "dino-s8": _dino_s8}

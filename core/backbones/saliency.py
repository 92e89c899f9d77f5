"""The embedded weights' saliency decoder: three transposed convolutions from patch tokens to a foreground map."""

from __future__ import annotations

from pathlib import Path

import torch
from safetensors.torch import load_file
from torch import Tensor, nn
from torch.nn import functional

CHANNELS = (256, 128, 64)


class SaliencyDecoder(nn.Module):
    """Foreground probability of every pixel from the backbone's last, normalised patch tokens."""

    def __init__(self, dim: int = 384) -> None:
        super().__init__()
        sizes = (dim, *CHANNELS)
        for step, (inside, outside) in enumerate(zip(sizes, CHANNELS), start=1):
            self.add_module(f"upconv{step}", nn.ConvTranspose2d(inside, outside, kernel_size=4, stride=2, padding=1))
            self.add_module(f"bn{step}", nn.BatchNorm2d(outside))
        self.final_conv = nn.Conv2d(CHANNELS[-1], 1, kernel_size=1)
        self.to(memory_format=torch.channels_last)  # type: ignore[call-overload]  # half the time on a CPU

    @staticmethod
    def load(file: Path) -> SaliencyDecoder:
        """From safetensors."""
        decoder = SaliencyDecoder()
        decoder.load_state_dict(load_file(file), strict=False)  # batch norm's step counter is not stored
        return decoder

    def forward(self, tokens: Tensor, side: int) -> Tensor:
        """Shape (V, side, side) in [0, 1] from tokens (V, D, G, G)."""
        hidden = tokens
        for step in range(1, len(CHANNELS) + 1):
            hidden = torch.relu(self.get_submodule(f"bn{step}")(self.get_submodule(f"upconv{step}")(hidden)))
        logits = functional.interpolate(self.final_conv(hidden), size=(side, side), mode="bilinear", align_corners=False)
        return logits.sigmoid().squeeze(1)

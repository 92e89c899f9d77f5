"""Makes the token statistics that ship with a backbone: `python -m benchmarks.token_statistics --data DIR`.

Mean and covariance of patch tokens, object and background alike, over every close crop of every burst below DIR. No label is used.
The shipped file is made from the sample bursts.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from benchmarks.parallel import bar
from clients.datasets.folders import load_burst
from clients.datasets.sources import find_sequences
from core.backbones import EMBEDDED, load_backbone
from core.backbones.whitening import STATISTICS, Whitening
from core.encode import Encoder

PATCHES_A_VIEW = 200
"""Drawn at random."""


def main(
    data: Annotated[Path, typer.Option(help="folder of bursts")],
    out: Annotated[Path, typer.Option()] = STATISTICS,
    backbone: Annotated[str, typer.Option(help="name of a backbone")] = EMBEDDED,
) -> None:
    """Writes the statistics of a backbone's patch tokens."""
    network = load_backbone(backbone, report=typer.echo)
    encoder = Encoder(network)
    rng = np.random.default_rng(0)
    tokens = []
    side = encoder.config.grid * network.patch_size
    with bar() as progress:
        for sequence in progress.track(find_sequences(data), description="encoding"):
            burst = load_burst(sequence)
            windows = [view.window for view in encoder.encode(burst).views]
            crops = np.stack([window.cut(view.rgb, side) for view, window in zip(burst.views, windows)])
            patches = network.extract(crops).patches.reshape(len(crops), -1, network.dim)
            tokens += [view[rng.permutation(len(view))[:PATCHES_A_VIEW]] for view in patches]
    typer.echo(f"wrote {Whitening.fit(np.concatenate(tokens)).save(network.name, out)}")


if __name__ == "__main__":
    typer.run(main)

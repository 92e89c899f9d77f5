"""How the pictures of benchmarks are written."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

DPI = 110


def save(figure: Figure, file: Path, title: str | None = None) -> None:
    """Writes a figure, with a title over all its panels where there is one; the folder is made where it is missing."""
    if title is not None:
        figure.suptitle(title, fontsize=10)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=DPI)

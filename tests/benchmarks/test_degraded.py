"""Encodings of degraded bursts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.degradations.geometry import camera_shift
from benchmarks.degraded import Remembering, encode_degraded, masked_views
from benchmarks.encoded import encode_all, read_encoded
from clients.datasets.folders import find_sequences, load_burst
from core.encode import Encoder

PARTS = ("patches", "cls", "attention", "saliency")


@pytest.fixture(autouse=True)
def own_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ONELOOK_CACHE", str(tmp_path / "cache"))


def test_a_picture_is_looked_at_once(backbone) -> None:
    images = np.random.default_rng(0).integers(0, 255, (3, 32, 32, 3)).astype(np.uint8)
    remembering = Remembering(backbone)
    remembering.extract(images[:2])
    found = remembering.extract(images[[2, 0, 1, 2]])
    assert backbone.calls == 2
    expected = backbone.extract(images[[2, 0, 1, 2]])
    for part in PARTS:
        np.testing.assert_allclose(getattr(found, part), getattr(expected, part), atol=1e-6)
    remembering.extract(images)
    assert backbone.calls == 3


def test_the_same_burst_is_encoded_once_and_another_anew(recorded: Path, backbone) -> None:
    views = load_burst(find_sequences(recorded)[0]).views
    encoder = Encoder(backbone)
    file = encode_degraded(views, encoder)
    calls = backbone.calls
    assert encode_degraded(views, encoder) == file
    assert backbone.calls == calls
    moved = [camera_shift(view, 5, np.random.default_rng(index)) for index, view in enumerate(views)]
    assert encode_degraded(moved, encoder) != file


def test_a_burst_is_encoded_as_ever(recorded: Path, backbone) -> None:
    sequence, encoder = find_sequences(recorded)[0], Encoder(backbone)
    fresh = encoder.encode(load_burst(sequence))
    kept = read_encoded(encode_degraded(load_burst(sequence).views, Encoder(Remembering(backbone))))
    for ours, theirs in zip(kept.views, fresh.views, strict=True):
        np.testing.assert_array_equal(ours.cells, theirs.cells)
        np.testing.assert_allclose(ours.points_m, theirs.points_m, atol=1e-5)


def test_the_product_is_not_told_the_silhouette(recorded: Path, backbone) -> None:
    views = load_burst(find_sequences(recorded)[0], masks=True).views
    wrong = [replace(view, mask=~view.mask) for view in views]
    assert encode_degraded(wrong, Encoder(backbone)) == encode_degraded(views, Encoder(backbone))


def test_where_no_silhouette_is_recorded_the_found_one_stands_in(recorded: Path, backbone) -> None:
    sequence = find_sequences(recorded)[0]
    (file,) = encode_all([sequence], Encoder(backbone))
    (exact,) = masked_views(sequence, file, [1])
    for mask in (sequence.path / "mask_visib").iterdir():
        mask.unlink()
    (found,) = masked_views(sequence, file, [1])
    assert (found.mask & exact.mask).sum() / (found.mask | exact.mask).sum() > 0.8

"""The cache of encoded bursts."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

import core
from benchmarks.encoded import SOURCES, encode_all, read_encoded
from clients.datasets.folders import find_sequences, load_burst
from core.encode import Encoder, EncoderConfig
from core.errors import NoObject

ARRAYS = ("cells", "descriptors", "points_m", "saliency", "cls", "pooled")


def test_what_is_read_is_what_was_encoded(recorded: Path, tmp_path: Path, backbone) -> None:
    sequence, encoder = find_sequences(recorded)[0], Encoder(backbone)
    (file,) = encode_all([sequence], encoder, tmp_path / "cache")
    fresh, read = encoder.encode(load_burst(sequence)), read_encoded(file)
    assert read.fingerprint == fresh.fingerprint
    assert read.stage_ms.keys() == fresh.stage_ms.keys()
    for ours, theirs in zip(read.views, fresh.views, strict=True):
        assert (ours.grid, ours.window) == (theirs.grid, theirs.window)
        for name in ARRAYS:
            np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), atol=2e-3)  # half precision
        np.testing.assert_array_equal(ours.camera.world_from_camera, theirs.camera.world_from_camera)


def test_images_alone_have_no_camera(recorded: Path, tmp_path: Path, backbone) -> None:
    folder = recorded / "egg" / "small"
    (folder / "scene_camera.json").unlink()
    (folder / "scene_gt.json").unlink()
    (sequence,) = (each for each in find_sequences(recorded) if each.instance == "small")
    (file,) = encode_all([sequence], Encoder(backbone), tmp_path / "cache")
    assert all(view.camera is None and not view.trusted.any() and len(view.cells) for view in read_encoded(file).views)


def test_nothing_is_encoded_twice(recorded: Path, tmp_path: Path, backbone) -> None:
    sequences = find_sequences(recorded)
    files = encode_all(sequences, Encoder(backbone), tmp_path / "cache")
    calls = backbone.calls
    assert encode_all(sequences, Encoder(backbone), tmp_path / "cache") == files
    assert backbone.calls == calls


def test_other_images_backbones_and_settings_are_encoded_anew(recorded: Path, tmp_path: Path, backbone) -> None:
    sequence = find_sequences(recorded)[0]
    files = encode_all([sequence], Encoder(backbone), tmp_path / "cache")
    files += encode_all([sequence], Encoder(backbone, EncoderConfig(margin=0.2)), tmp_path / "cache")
    backbone.fingerprint = "colour-2"
    files += encode_all([sequence], Encoder(backbone), tmp_path / "cache")
    image = cv2.imread(str(sequence.images[0]))
    cv2.imwrite(str(sequence.images[0]), image[::-1])
    files += encode_all([sequence], Encoder(backbone), tmp_path / "cache")
    assert len(set(files)) == 4


def test_views_are_encoded_each_for_itself(recorded: Path, backbone) -> None:
    """So that some views of an encoded burst are what encoding those views alone would give."""
    burst, encoder = load_burst(find_sequences(recorded)[0]), Encoder(backbone)
    selected, alone = encoder.encode(burst).select([2, 0]), encoder.encode(burst.select([2, 0]))
    for ours, theirs in zip(selected.views, alone.views, strict=True):
        for name in ARRAYS:
            np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=1e-5)


def test_the_cache_depends_on_every_source_that_encodes() -> None:
    root = Path(core.__file__).parent
    sources = {source for pattern in SOURCES for source in root.glob(pattern)}
    imported = {name for source in sources for name in re.findall(r"^from core\.([a-z0-9_]+)", source.read_text(), re.MULTILINE)}
    assert imported - {"errors", "clock", "backbones"} <= {source.stem for source in sources}


def test_a_sequence_without_an_object_is_named(recorded: Path, tmp_path: Path, backbone) -> None:
    (sequence,) = (each for each in find_sequences(recorded) if each.instance == "small")
    for image in sequence.images:
        cv2.imwrite(str(image), np.zeros_like(cv2.imread(str(image))))
    with pytest.raises(NoObject, match="egg/small: no view shows an object"):
        encode_all([sequence], Encoder(backbone), tmp_path / "cache")

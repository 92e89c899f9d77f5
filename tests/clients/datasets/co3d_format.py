"""Writes folders in CO3D's published format."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from core.views import Camera

FLIP = np.diag([-1.0, -1.0, 1.0])
SCALE_ADJUSTMENT = 0.37


def viewpoint(camera: Camera, size: tuple[int, int], form: str) -> dict[str, Any]:
    """A camera as CO3D writes it, from PyTorch3D's definitions: x_camera = x_world · R + T, x left, y up, NDC from the centre."""
    rotation = FLIP @ camera.camera_from_world[:3, :3]
    shift = FLIP @ camera.camera_from_world[:3, 3]
    half = np.array([size[1], size[0]]) / 2
    unit = half if form == "ndc_norm_image_bounds" else np.full(2, half.min())
    centre = np.array([camera.K[0, 2], camera.K[1, 2]]) + 0.5
    said = {"intrinsics_format": form} if form == "ndc_isotropic" else {}  # version 1 does not name its format
    return {
        "R": rotation.T.tolist(),
        "T": shift.tolist(),
        "focal_length": (np.array([camera.K[0, 0], camera.K[1, 1]]) / unit).tolist(),
        "principal_point": ((half - centre) / unit).tolist(),
        **said,
    }


def write_sequence(root: Path, category: str, name: str, shots: list[Any], points: NDArray[np.floating], form: str) -> list[dict[str, Any]]:
    """A sequence's files, and its frame annotations; `shots` have camera, rgb, depth_m and mask, `points` are the point cloud's."""
    frames = []
    for number, shot in enumerate(shots, start=1):
        names = {
            "image": f"{category}/{name}/images/frame{number:06}.jpg",
            "depth": f"{category}/{name}/depths/frame{number:06}.jpg.geometric.png",
            "consistent": f"{category}/{name}/depth_masks/frame{number:06}.png",
            "mask": f"{category}/{name}/masks/frame{number:06}.png",
        }
        for each in names.values():
            (root / each).parent.mkdir(parents=True, exist_ok=True)
        half_floats = np.where(shot.mask, shot.depth_m / SCALE_ADJUSTMENT, np.inf).astype(np.float16)
        cv2.imwrite(str(root / names["image"]), shot.rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 98])
        cv2.imwrite(str(root / names["depth"]), half_floats.view(np.uint16))
        cv2.imwrite(str(root / names["consistent"]), shot.mask.astype(np.uint8) * 255)
        cv2.imwrite(str(root / names["mask"]), np.where(shot.mask, 230, 60).astype(np.uint8))
        frames.append(
            {
                "sequence_name": name,
                "frame_number": number - 1,
                "frame_timestamp": 0.1 * number,
                "image": {"path": names["image"], "size": list(shot.rgb.shape[:2])},
                "depth": {"path": names["depth"], "scale_adjustment": SCALE_ADJUSTMENT, "mask_path": names["consistent"]},
                "mask": {"path": names["mask"], "mass": float(shot.mask.sum())},
                "viewpoint": viewpoint(shot.camera, shot.rgb.shape[:2], form),
                "meta": {"frame_type": "train_known", "frame_splits": ["multisequence_train_known"], "eval_batch_maps": []},
            }
        )
    write_cloud(root / category / name / "pointcloud.ply", points)
    return frames


def write_cloud(path: Path, points: NDArray[np.floating]) -> None:
    """A binary PLY with normals and colours, as PyTorch3D writes it."""
    kind = np.dtype([(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")] + [(name, "u1") for name in ("red", "green", "blue")])
    vertices = np.zeros(len(points), kind)
    for name, column in zip("xyz", points.T):
        vertices[name] = column
    properties = "".join(f"property {'float' if kind[name].kind == 'f' else 'uchar'} {name}\n" for name in kind.names or ())
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{properties}end_header\n"
    path.write_bytes(head.encode() + vertices.tobytes())


def write_annotations(root: Path, category: str, frames: list[dict[str, Any]]) -> None:
    """The two files of a category."""
    write_jgz(root / category / "frame_annotations.jgz", frames)
    sequences = [
        {"sequence_name": name, "category": category, "video": None, "viewpoint_quality_score": 1.2, "point_cloud": None}
        for name in sorted({frame["sequence_name"] for frame in frames})
    ]
    write_jgz(root / category / "sequence_annotations.jgz", sequences)


def write_jgz(path: Path, content: Any) -> None:
    """Gzipped JSON."""
    with gzip.open(path, "wt", encoding="utf-8") as stream:
        json.dump(content, stream)


def label(root: Path, category: str, name: str, reference: str, trans: Any) -> None:
    """A pose label as its authors publish it."""
    folder = root / "class_labels" / category
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps({"trans": np.asarray(trans).tolist(), "seq": name, "reference_seq": reference}))

"""Seconds that the service takes for each page of the console, of a memory with many categories and observations.

    python tests/console/pages_of_a_large_memory.py --categories 500 --observations 10000

The memory is one category and a few observations of the tests' synthetic world, copied row by row.
"""

from __future__ import annotations

import argparse
import io
import json
import sqlite3
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from conftest import ColourBackbone, Ellipsoid  # noqa: E402
from fastapi.testclient import TestClient  # noqa: E402

from core.camera_poses import hemisphere  # noqa: E402
from core.sim3 import Sim3  # noqa: E402
from service.app import create_app  # noqa: E402
from service.settings import Settings  # noqa: E402
from store.connection import DATABASE  # noqa: E402

REPEATS = 5


def main() -> None:
    """See module."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--categories", type=int, default=500)
    parser.add_argument("--observations", type=int, default=10_000)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(data_dir=Path(folder) / "memory", keep_observations=asked.observations, variant="ucd", score="pooled_best_view")
        with TestClient(create_app(settings, backbone=ColourBackbone())) as client:
            seed(client)
        multiply(settings.data_dir / DATABASE, asked.categories, asked.observations)
        with TestClient(create_app(settings, backbone=ColourBackbone())) as client:
            rows = [measure(client, path) for path in pages(client)]
    say(f"{asked.categories} categories, {asked.observations} observations; seconds of the service, median of {REPEATS}")
    for row in rows:
        say(f"{row['seconds']:8.3f}  {row['kilobytes']:6.0f} kB  {row['path']}")
    if asked.json:
        asked.json.write_text(json.dumps({"meta": {"categories": asked.categories, "observations": asked.observations}, "rows": rows}))


def say(line: str) -> None:
    """To whoever waits."""
    sys.stdout.write(f"{line}\n")


def burst(views: int, colour: tuple[float, float]) -> bytes:
    """Of an object, as npz."""
    thing = Ellipsoid(np.array([0.10, 0.07, 0.05]), colour)
    seen = [thing.view(Sim3.identity(), pose) for pose in hemisphere(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.5, views)]
    buffer = io.BytesIO()
    np.savez(
        buffer,
        rgb=np.stack([view.rgb for view in seen]),
        depth_m=np.stack([view.depth_m for view in seen]),
        K=Ellipsoid.K,
        world_from_camera=np.stack([view.camera.world_from_camera for view in seen]),
    )
    return buffer.getvalue()


def seed(client: TestClient) -> None:
    """A category, and observations that are known and novel."""

    def post(path: str, **more: Any) -> Any:
        answer = client.post(path, **more)
        assert answer.is_success, answer.text
        return answer.json()

    body = {"content": burst(8, (190, 60)), "headers": {"Content-Type": "application/x-npz"}}
    scan = post("/v1/observations", **body)["scan"]
    post(f"/v1/scans/{scan['id']}/views", **body)
    post(f"/v1/scans/{scan['id']}/complete", json={"name": "ball"})
    post("/v1/observations", **body)
    post("/v1/observations", content=burst(8, (80, 40)), headers=body["headers"])


def multiply(database: Path, categories: int, observations: int) -> None:
    """Copies of the rows that there are, under ids of their own."""
    with sqlite3.connect(database) as db:
        columns = {
            table: [row[1] for row in db.execute(f"PRAGMA table_info({table})")] for table in ("categories", "observations", "instances")
        }

        def copy(table: str, row_id: str, **changes: str) -> str:
            (copied,) = db.execute("SELECT lower(hex(randomblob(16)))").fetchone()
            chosen = (
                {name: f'"{name}"' for name in columns[table]}
                | {"id": f"'{copied}'"}
                | {name: f"'{each}'" for name, each in changes.items()}
            )
            db.execute(
                f"INSERT INTO {table} SELECT {', '.join(chosen[name] for name in columns[table])} FROM {table} WHERE id = ?", [row_id]
            )
            return str(copied)

        ((category_id,),) = db.execute("SELECT id FROM categories").fetchall()
        ids = [category_id]
        (instance_id,) = db.execute("SELECT id FROM instances ORDER BY rowid LIMIT 1").fetchone()
        while len(ids) < categories:
            made = copy("categories", category_id, name=f"kind {len(ids)}", origin_id=f"{len(ids):032x}")
            copy("instances", instance_id, category_id=made)
            ids.append(made)
        seen = db.execute("SELECT id, outcome FROM observations ORDER BY rowid").fetchall()
        for number in range(observations - len(seen)):
            observation_id, outcome = seen[1 + number % 2]
            copy("observations", observation_id, **({"category_id": ids[number % len(ids)]} if outcome == "known" else {}))


def pages(client: TestClient) -> list[str]:
    """Their addresses. Of one category and one observation: those that were not copied, since they alone have files."""
    category = client.get("/v1/categories").json()["categories"][0]["id"]
    known = client.get("/v1/observations", params={"category_id": category, "limit": 1000}).json()["observations"][-1]["id"]
    middle = client.get("/v1/observations", params={"outcome": "known", "limit": 1000}).json()["observations"][-1]["id"]
    lists = ["/", "/categories", "/observations", "/observations?outcome=novel", f"/observations?before={middle}"]
    return [
        *lists,
        f"/observations?category_id={category}",
        f"/observations/{known}",
        f"/categories/{category}",
        "/memory",
        "/memory/map",
        "/try",
    ]


def measure(client: TestClient, path: str) -> dict[str, Any]:
    """Of one page."""
    spent = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        answer = client.get(path)
        spent.append(time.perf_counter() - start)
        assert answer.status_code == 200, f"{path}: {answer.status_code}"
    return {"path": path, "seconds": statistics.median(spent), "kilobytes": len(answer.content) / 1000}


if __name__ == "__main__":
    main()

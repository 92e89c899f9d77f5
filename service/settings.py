"""The service's settings, from the environment (`ONELOOK_*`) or from the caller."""

from __future__ import annotations

import os
from datetime import timedelta
from ipaddress import ip_address
from pathlib import Path

from platformdirs import user_data_path
from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from core.backbones import EMBEDDED
from core.calibration import LARGEST_RATE
from core.errors import InvalidInput
from core.scores import DEFAULT_SCORE
from service.logs import Form
from store.retention import Retention

SMALLEST_RATE = 1e-4
"""Of false answers that may be asked for: how rare rarer ones are, some hundreds of decisions do not tell."""
MOST_VIEWPOINTS = 64
"""Of one scan."""
LONGEST_DAYS = 36_500
"""That anything is kept by its age: a calendar ends, and a hundred years are for ever."""


class Settings(BaseSettings):
    """Everything that is decided before the service starts."""

    model_config = SettingsConfigDict(env_prefix="ONELOOK_", frozen=True)

    data_dir: Path = Field(
        default_factory=lambda: user_data_path("onelook") / "memory", description="Folder of the memory; made where it is missing."
    )
    host: str = Field("127.0.0.1", description="Address to listen on; one that other machines reach takes a key (`onelook keys create`).")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0 takes a free one.")
    backbone: str = Field(EMBEDDED, description="Name of a backbone, such as `dinov2-s14`, or a folder or hub name of the DINO family.")
    device: str = Field("cpu", description="Torch device of the backbone: `cpu`, `cuda`, `cuda:1`.")
    score: str = Field(DEFAULT_SCORE, description="How similar two bursts are, for the decision.")
    threshold: float | None = Field(
        None, allow_inf_nan=False, description="Least similarity of a known object; from the rate, or the score's own, where left out."
    )
    false_known_rate: float = Field(
        0.01,
        ge=SMALLEST_RATE,
        le=LARGEST_RATE,
        description="Of objects of no known category, the share that may be called known; of score `best`.",
    )
    variant: str = Field("best", description="Variant of the pose pipeline.")
    max_upload_mb: int = Field(128, gt=0, description="Largest request body, in megabytes of 1 000 000 bytes.")
    workers: int = Field(2, gt=0, description="Requests that are worked on at once; those that come together share passes of the backbone.")
    queue: int = Field(16, ge=0, description="Requests that may wait; more are answered 503 with Retry-After.")
    deadline_s: float = Field(
        90, gt=0, description="Seconds for a body to come, and then for its answer; after that it is answered 503, and nothing is changed."
    )
    max_tracks: int = Field(4, ge=0, description="Objects that are followed at once over WS /v1/track.")
    rate_limit: int = Field(3000, gt=0, description="Requests a minute with one key; more are answered 429 with Retry-After.")
    log: Form = Field("text", description="Lines of the log: `text` for people, `json` for programs.")
    session_h: float = Field(
        12, gt=0, le=24 * LONGEST_DAYS, description="Hours after which somebody who signed in to the console is signed out."
    )
    backup_dir: Path | None = Field(None, description="Folder that backups are made in; beside the memory where left out.")
    encoders: int = Field(2, gt=0, description="Processes that encode bursts, of `onelook serve --cluster`.")
    solvers: int = Field(2, gt=0, description="Processes that solve poses, of `onelook serve --cluster`.")
    max_views: int = Field(32, gt=0, description="Most views in one burst.")
    max_megapixels: int = Field(128, gt=0, description="Most pixels of a burst, all views together; decoded, each takes 8 to 16 bytes.")
    scan_views: int = Field(10, ge=2, le=MOST_VIEWPOINTS, description="Viewpoints that a scan asks for.")
    scan_expiry_h: float = Field(24, gt=0, le=24 * LONGEST_DAYS, description="Hours after which a scan expires that no views come for.")
    keep_observations: int = Field(1000, gt=0, description="Observations kept, with their views; the oldest are dropped.")
    undo_days: float = Field(
        30,
        ge=0,
        le=LONGEST_DAYS,
        description="Days for which a rename, merge, split, correction, forgotten burst or deletion can be undone.",
    )

    @property
    def retention(self) -> Retention:
        """How much the memory keeps, and how long."""
        return Retention(self.keep_observations, timedelta(days=self.undo_days), timedelta(hours=self.scan_expiry_h))

    @property
    def backups(self) -> Path:
        """Where backups are made."""
        memory = Path(os.path.abspath(self.data_dir))  # `.` and `..` have no name to put beside; links stay as they are
        return self.backup_dir or memory.with_name(f"{memory.name}-backups")

    def require_consistent(self) -> None:
        """Raises InvalidInput for settings that would starve the service."""
        if self.scan_views > self.max_views:
            raise InvalidInput(
                "ONELOOK_SCAN_VIEWS",
                f"asks for {self.scan_views} views of a scan, ONELOOK_MAX_VIEWS takes {self.max_views} in one request; raise it",
            )

    def require_safe(self, keys: int) -> None:
        """Raises InvalidInput where other machines would reach a service that has no keys, `keys` being how many are valid."""
        if not (keys or self._local):
            raise InvalidInput(
                "ONELOOK_HOST",
                f"is {self.host}, which other machines reach, and nobody has a key: make one with `onelook keys create NAME --role admin`, "
                "or listen on 127.0.0.1",
            )

    @property
    def _local(self) -> bool:
        try:
            return self.host == "localhost" or ip_address(self.host).is_loopback
        except ValueError:  # a name, which may be anywhere
            return False

"""The parts, put together.

MemoryOwner    one     HTTP, decisions, the memory, which it alone writes; asks
├── Encoder    many    bursts to tokens
└── PoseSolver many    poses, and verification by them
"""

from __future__ import annotations

import logging.config
from typing import Any

from fastapi import FastAPI
from ray import serve
from ray.serve.handle import DeploymentHandle

from core.backbones.base import Backbone
from service.app import create_app
from service.cluster.remote import Facts, RemoteBackbone, RemoteEncoder, RemoteSolver
from service.cluster.replicas import EncoderReplica, PoseSolverReplica
from service.compute import Compute
from service.logs import config
from service.settings import Settings

SHARE = 0.5
"""Of a core, that Ray keeps for each process that computes, where no configuration says otherwise: two a core, of which one may wait."""
AT_ONCE = 2
"""Bursts or poses in one process: the second is there when the first is done, and bursts that are there together share passes."""
CONNECTIONS = 1000
"""Of the application, listeners and followers of objects included; its own queue bounds the work."""

POLL_S = 0.2
"""How often a process that is to end looks whether it is still working on something."""


@serve.ingress()
class Application:
    """The one process that has the memory, with the application around it."""

    async def __init__(  # type: ignore[misc]  # Ray Serve awaits it
        self, settings: Settings, encoders: DeploymentHandle[Any], solvers: DeploymentHandle[Any]
    ) -> None:
        logging.config.dictConfig(config(settings.log))
        facts: Facts = await encoders.facts.remote()
        backbone = RemoteBackbone(facts.name, facts.fingerprint, facts.whitening)
        self._settings = settings
        self._compute = Compute(backbone, RemoteEncoder(encoders), RemoteSolver(solvers))

    def __serve_build_asgi_app__(self) -> FastAPI:
        """What Ray Serve passes requests to."""
        return create_app(self._settings, compute=self._compute)


def application(settings: Settings, backbone: Backbone | None = None) -> serve.Application:
    """All parts, bound to each other; the encoders load the backbone of the settings unless one is given."""
    shares: dict[str, float] = {"num_cpus": SHARE}
    on_gpu = shares | {"num_gpus": 1} if settings.device.startswith("cuda") else shares
    ending: dict[str, Any] = {"graceful_shutdown_wait_loop_s": POLL_S, "graceful_shutdown_timeout_s": settings.deadline_s}
    many: dict[str, Any] = ending | {"max_ongoing_requests": AT_ONCE}
    encoder = serve.deployment(name="Encoder", num_replicas=settings.encoders, ray_actor_options=on_gpu, **many)
    solver = serve.deployment(name="PoseSolver", num_replicas=settings.solvers, ray_actor_options=shares, **many)
    owner = serve.deployment(name="MemoryOwner", max_ongoing_requests=CONNECTIONS, ray_actor_options={"num_cpus": 0}, **ending)
    encoders, solvers = encoder(EncoderReplica).bind(settings, backbone), solver(PoseSolverReplica).bind(settings)
    return owner(Application).bind(settings, encoders, solvers)


def configured(args: dict[str, Any]) -> serve.Application:
    """For a configuration of Ray Serve's own, such as docker/cluster/serve.yaml: its `args` are settings, the environment has the rest."""
    return application(Settings(**args))

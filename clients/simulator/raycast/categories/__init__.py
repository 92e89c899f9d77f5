"""The simulator's own categories, by name. They are data of the simulator; the service never hears a name."""

from __future__ import annotations

from collections.abc import Mapping

from clients.simulator.raycast.categories import devices, home, kitchen, toys, vehicles
from clients.simulator.raycast.mesh import turns
from clients.simulator.raycast.model import Recipe

AROUND = turns(72)
"""Of a body of revolution: every 5°, so that no rotation about z counts for more than 2.5°."""

RECIPES: Mapping[str, Recipe] = {
    "aeroplane": Recipe(vehicles.aeroplane, (0.26, 0.38)),
    "bear": Recipe(toys.bear, (0.22, 0.34)),
    "bottle": Recipe(kitchen.bottle, (0.24, 0.34), AROUND),
    "camera": Recipe(devices.camera, (0.2, 0.28)),
    "car": Recipe(vehicles.car, (0.22, 0.34)),
    "chair": Recipe(home.chair, (0.26, 0.38)),
    "clock": Recipe(home.clock, (0.2, 0.28)),
    "duck": Recipe(toys.duck, (0.2, 0.3)),
    "guitar": Recipe(toys.guitar, (0.32, 0.44)),
    "headphones": Recipe(devices.headphones, (0.24, 0.32), turns(2)),
    "house": Recipe(home.house, (0.26, 0.38)),
    "lamp": Recipe(home.lamp, (0.28, 0.4), AROUND),
    "laptop": Recipe(devices.laptop, (0.3, 0.42)),
    "locomotive": Recipe(vehicles.locomotive, (0.26, 0.36)),
    "mug": Recipe(kitchen.mug, (0.18, 0.24)),
    "present": Recipe(home.present, (0.22, 0.32), turns(4)),
    "sailboat": Recipe(vehicles.sailboat, (0.28, 0.4)),
    "teapot": Recipe(kitchen.teapot, (0.22, 0.32)),
}

"""A world that is rendered: procedural objects and meshes on a table in a room, seen by ray casting on the CPU."""

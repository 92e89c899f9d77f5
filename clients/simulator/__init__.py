"""A simulated robot: worlds, episodes and their reports."""

"""Cameras a robot looks through: one small protocol (`base.RobotCamera`), and what follows it."""

"""The application past one machine: Ray Serve starts, places, watches and restarts its parts, and carries what they tell each other."""

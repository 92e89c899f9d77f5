"""The method: arrays in, arrays out. No files, SQL, HTTP or global state (weights are the one file it reads)."""

import os

os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
# Read once, when torch is loaded. Threads that spin while they wait for each other are a little quicker on idle cores, and ten times
# slower where requests share them.

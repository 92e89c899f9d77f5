"""The method: arrays in, arrays out. No SQL, HTTP or global state; what ships with a backbone, weights and statistics, is all it reads."""

import os

# Both are read once, when torch and numpy are loaded. Threads that spin while they wait for each other are a little quicker on idle
# cores, and ten times slower where requests share them; numpy's products here are too small to be shared among threads at all.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

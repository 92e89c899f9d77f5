"""The method: arrays in, arrays out. No files, SQL, HTTP or global state (weights are the one file it reads)."""

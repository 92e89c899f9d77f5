"""The memory on disk: SQLite rows for what is asked about, npz and image files for what is computed with."""

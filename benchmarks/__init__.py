"""Accuracy, discovery and speed: each benchmark prints a table and writes JSON."""

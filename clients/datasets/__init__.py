"""Readers of data sets; each gives sequences and bursts."""

"""Cyclic Coordinate Descent (Wang and Chen 1991)."""

"""Compiled mathematics on plain arrays and tuples; imports nothing of the package but itself."""

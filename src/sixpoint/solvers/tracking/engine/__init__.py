"""The compiled part of marker tracking."""

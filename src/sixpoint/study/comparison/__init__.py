"""Comparisons of methods: what they hold, tables, curves, poses, statements tested."""

"""The command line: parse, call a job, print. Every command has a module, every job is in ``jobs``."""

from sixpoint.cli.app import main

__all__ = ["main"]

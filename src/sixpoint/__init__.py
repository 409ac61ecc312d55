"""Natural full-body poses from six tracked points."""

__version__ = "0.1.0"

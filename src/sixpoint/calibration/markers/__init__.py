"""Labelled markers -> a person's segment lengths and where each marker sits. See ``calibrate``."""

from sixpoint.calibration.markers.calibrate import calibrate_markers

__all__ = ["calibrate_markers"]

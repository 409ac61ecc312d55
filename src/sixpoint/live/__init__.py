"""Live tracking: packets -> readings of trackers -> pose -> packets."""

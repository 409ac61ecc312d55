"""A reconstruction as start and attractor of prioritized IK: feet that stand, and whatever else must hold."""

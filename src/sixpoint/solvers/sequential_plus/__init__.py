"""SIK+: the sequence of Sequential IK with better steps and no trained model."""

"""Elbows stay out of the trunk: part of the limb step of Sequential IK, SIK+ and SIK with a prior."""

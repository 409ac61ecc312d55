"""The figures of Unzueta et al. 2008 that show Sequential IK itself."""

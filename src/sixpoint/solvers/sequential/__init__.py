"""Sequential IK (Unzueta et al. 2008): one file per step of the paper."""

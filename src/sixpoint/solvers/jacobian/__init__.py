"""The Jacobian methods that Unzueta et al. 2008 compare with: one loop, five step rules."""

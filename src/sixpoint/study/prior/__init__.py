"""Fitting of the prior: recordings in, a few thousand numbers out. Needs ``sixpoint[fit]``."""

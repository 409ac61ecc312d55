"""SIK with a small fitted prior: SIK+ whose trunk and limbs begin where people's are."""

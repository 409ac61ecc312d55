"""How six trackers sit on a person, and how long the person is, from a still pose and some movement.

What can be known follows from what is rigid. A tracker's offset from its joint is constant in the tracker's
frame, but the six tracked segments are not neighbours: between foot and pelvis lie knee and hip, and for any
offset within reach there is a pose that explains every single frame. So an offset is observable only where
the movement itself is constrained:

- a hand, foot or head that circles while its joint rests: all but the direction of the bone (``pivots``),
- the heights of a standing person: that direction, as well as lengths are known (``calibrate``),
- legs that are straight: the pelvis (``legs``),
- a pose that was asked for: mount rotations, to the degrees to which it was held (``standing``),
- standing joints: four lengths; the others are proportions (``lengths``).

Every offset comes with its standard deviation, and what is worse than a centimetre is listed as unobserved.
See ``docs/calibration.md``.
"""

"""USD: motions and skinned surfaces as UsdSkel, read and written with usd-core (the extra ``usd``).

A file holds a ``SkelRoot`` with a ``Skeleton`` (whose rest pose is ours: identity rotations), a
``SkelAnimation`` with one time sample per frame, and, where there is a shape, a skinned ``Mesh``. Unit and up
axis are in the file, so nothing is guessed.

Precision is UsdSkel's own: translations, rotations, points and weights are 32-bit floats (about 1e-7 of their
size), scales are half floats, which is why only scales of one are written. Rest and bind poses are double.
"""

USD_SUFFIXES = (".usd", ".usda", ".usdc")

SITES = "userProperties:sites"
"""Namespace of what USD has no word for: end sites, points fixed to a joint."""

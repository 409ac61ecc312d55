"""Prioritized IK with the FLEXT constraint.

``tasks`` is what users write, ``blocks`` and ``limbs`` lower tasks, ``model`` a body; ``engine`` is compiled;
``solver`` is the public class.
"""

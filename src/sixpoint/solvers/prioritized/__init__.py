"""Prioritized IK with the FLEXT constraint.

``tasks`` is what users write; ``model`` with ``blocks`` and ``limbs`` lowers it; ``frame`` is the compiled loop over
``rows`` (errors and Jacobians), ``step`` (levels), ``limits``; ``solver`` is the public class.
"""

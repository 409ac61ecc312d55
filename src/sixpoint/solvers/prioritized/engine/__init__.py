"""The compiled engine: ``frame`` loops over ``rows`` (errors, Jacobians), ``step`` (levels), ``limits``."""

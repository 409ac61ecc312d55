"""KMA (Kulpa, Multon and Arnaldi 2005) as adapted by Unzueta et al. 2008."""

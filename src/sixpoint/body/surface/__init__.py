"""The skin: a mesh on a figure, made or read, and what elbows stay out of."""

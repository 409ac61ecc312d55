"""Marker recordings: followed, reported, reduced to six points, replayed live."""

"""Surfaces in another form with the same points: degrees, pieces, directions, kinds."""

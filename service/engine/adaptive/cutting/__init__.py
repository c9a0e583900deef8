"""Faces cut into cells that are as flat as the goal asks, in the direction in which they bend."""

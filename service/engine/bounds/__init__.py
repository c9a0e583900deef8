"""Proved bounds of the distance of meshes from their surfaces."""

"""Reads meshes with trimesh: each file is first written again in a plain form, and counted."""

"""Connectivity: which sides of patches are one edge, and which points are one corner."""

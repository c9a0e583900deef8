"""Queries of a surface, with proved results: closest points, and hits of rays."""

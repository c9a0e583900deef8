"""Queries of a surface with proved results: closest points, hits of rays."""

"""Gaussian and mean curvatures of whole meshes, from second partials at every sample."""

"""Meshes of tubes and ribbons by tolerance, with bounds for round tubes and smooth ribbons."""

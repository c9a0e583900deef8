"""Meshes of tubes and ribbons."""

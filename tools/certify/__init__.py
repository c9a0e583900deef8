"""Judges certified meshes of many random surfaces from their files alone, by sampling."""

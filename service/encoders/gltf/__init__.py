"""Writes glTF 2.0: meshes and scenes, in float32 or in compact forms."""

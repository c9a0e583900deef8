"""Writes glTF 2.0: arrays, materials, meshes and scenes, with float32 or in compact forms."""

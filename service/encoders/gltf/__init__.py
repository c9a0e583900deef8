"""glTF 2.0, written by us: arrays, materials, meshes and scenes, plain and compact."""

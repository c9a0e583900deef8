"""All that is proved of meshes: how far they are from their surfaces."""

"""Several models as one: placements, base colours, and merging of meshes."""

"""Several models as one: placements, base colours, and meshes put together."""

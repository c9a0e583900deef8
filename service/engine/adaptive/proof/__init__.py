"""How far the surface can be from a mesh: bounds, proved and rounded upwards."""

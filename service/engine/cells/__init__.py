"""Cells of nets: the tree of cells, their models, and the tree of bounding spheres."""

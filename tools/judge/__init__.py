"""A judge of meshes that shares no code with what made them: `make judge`.

It reads a document and a file, as any client has them, and proves, from the theorem alone, that no
point of the surface is further from the triangles of the file than the bound that came with it.
"""

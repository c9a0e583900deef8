"""A judge of meshes that shares no code with the engine: `make judge`.

It reads the document of a request and the file of its response, as a client has them. It proves
that no point of the surface is further from the triangles of the file than the reported bound. The
proof uses only the theorem in `tools.judge.proof`.
"""

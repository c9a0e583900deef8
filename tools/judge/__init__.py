"""Judges that share no code with the engine: `make judge` and `make judge-queries`.

The judge of meshes reads the document of a request and the file of its response, as a client has
them. It proves that no point of the surface is further from the triangles of the file than the
reported bound. The proof uses only the theorem in `tools.judge.proof`. The judges of queries,
`closest` and `rays`, search for nearer points and missed hits.
"""

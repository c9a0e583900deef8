"""Pictures of meshes: which triangle each sample of a pixel shows, by NumPy alone."""

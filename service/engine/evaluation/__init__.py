"""Points and unit normals of patches on grids of samples: three methods, poles included."""

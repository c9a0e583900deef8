"""The division of the sides of faces, by rules that depend on the side alone."""

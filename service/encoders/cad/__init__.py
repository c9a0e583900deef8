"""Files of definitions: surfaces as they are defined, not their meshes."""

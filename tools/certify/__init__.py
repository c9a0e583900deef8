"""Whether certified meshes are what they say: many random surfaces, looked at from outside."""

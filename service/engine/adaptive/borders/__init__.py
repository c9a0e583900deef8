"""Where the sides of faces are divided: by rules that depend on what a side is alone."""

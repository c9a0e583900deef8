"""Other mesh makers, each a program of its own that runs in a Python of its own."""

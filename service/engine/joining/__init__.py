"""Makes borders that are equal up to rounding equal bit for bit, before meshing."""

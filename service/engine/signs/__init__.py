"""Which points are inside a closed surface: winding numbers, with a proof."""

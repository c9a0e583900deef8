"""Bézier nets of a model: halving, restriction, blossoms, hulls and partials."""

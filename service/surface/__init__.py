"""Kinds of surface: frozen values, checked when created, and their lowering to Bézier patches."""

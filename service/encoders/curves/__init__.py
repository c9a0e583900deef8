"""The formats of curves: a registry of their own."""

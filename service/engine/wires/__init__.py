"""Isoparametric curves of surfaces, and what they are drawn as."""

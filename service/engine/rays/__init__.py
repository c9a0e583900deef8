"""Hits of rays on a surface, with a proof that none is missed."""

"""Borders that are equal up to rounding made equal bit for bit, before anything is meshed."""

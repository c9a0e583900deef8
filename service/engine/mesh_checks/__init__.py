"""Meshes that anyone has made: their faults, and how far they and their surface are apart."""

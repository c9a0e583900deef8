"""Cuts faces into cells that are flat enough for the goal, in the direction in which they bend."""

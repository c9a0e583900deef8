"""Answers that may be kept: their names, their codings, and the memory that holds them."""

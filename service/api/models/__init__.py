"""The models of answers."""

"""Responses that the service keeps in memory: their names, their codings, and how they are sent."""

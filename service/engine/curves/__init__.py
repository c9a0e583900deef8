"""Curves as samples: points, tangents, lengths, certified chords."""

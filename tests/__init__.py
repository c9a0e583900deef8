"""Tests, in the same folders as what they test; `oracles` holds the slow truths."""

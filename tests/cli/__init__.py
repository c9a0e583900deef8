"""Tests of the command `surface`."""

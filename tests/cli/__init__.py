"""Tests of the program `surface`."""

"""The program `surface`: its commands are rows of tables.

Slow modules are imported inside functions, so that `--help` is fast.
"""

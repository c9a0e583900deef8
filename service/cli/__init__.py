"""The program `surface`, one file for each command.

Each command imports slow modules inside its functions, so that `--help` is fast.
"""

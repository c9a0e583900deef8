"""The command `surface`, one file a command.

Each command imports its slow modules itself, so that `--help` is fast.
"""

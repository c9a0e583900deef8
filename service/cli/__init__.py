"""The command `surface`, one file a command.

Whatever is heavy is imported by the command that needs it, so that `--help` answers at once.
"""

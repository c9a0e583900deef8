"""The process of the service: its connections, signals and log."""

"""The process that serves: connections, signals, its log."""

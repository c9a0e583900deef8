"""What is seen of the service from outside: ids, log, numbers, traces, health."""

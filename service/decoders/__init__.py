"""Files that hold control nets, to documents in the language of requests: one format a file."""

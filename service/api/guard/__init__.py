"""Access: keys, signed URLs, rates, and the address of the client."""

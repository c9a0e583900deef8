"""Programs of generators of clients, from the OpenAPI document: `make test-generators`."""

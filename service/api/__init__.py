"""HTTP: routes, negotiation, problems, limits and documentation. Nothing here computes."""

"""Who may do what: keys, signed addresses, rates, and who it is that asks."""

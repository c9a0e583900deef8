"""Settings of the service: `SURFACE_…` in the environment, and flags of `surface serve`."""

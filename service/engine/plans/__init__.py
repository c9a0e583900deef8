"""Plans: what follows from connectivity and resolution, made once and cached."""

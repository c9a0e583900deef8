"""Areas, lengths, volumes and centroids of surfaces, each with a proved interval."""

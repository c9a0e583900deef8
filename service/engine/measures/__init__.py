"""Areas, lengths, volumes and centroids of surfaces, each with an interval that holds it."""

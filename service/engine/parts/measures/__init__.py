"""Areas, volumes, centroids and lengths of whole parts, each with a proved interval."""

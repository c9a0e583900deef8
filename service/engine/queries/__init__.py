"""Questions to a surface whose answers are proved: closest points, rays."""

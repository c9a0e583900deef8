"""Files of CAD systems for tests: written by Open CASCADE, and judged against it."""

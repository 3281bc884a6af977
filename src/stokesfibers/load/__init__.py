"""External force densities, one per file."""

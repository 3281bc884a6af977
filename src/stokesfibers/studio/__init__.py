"""Looking at runs: viewer, movie, report, export."""

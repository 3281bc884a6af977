"""Many runs and trust: sweeps, validation."""

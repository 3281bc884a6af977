"""Published figures as experiments: each one is computed, drawn and checked by one file."""

"""Sums over other fibers and their periodic images."""

"""The validation suite: exact answers, published numbers, independent calculations, orders."""

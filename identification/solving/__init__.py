"""Weighted least squares from many starts."""

"""Base classes of laws, and their smooth functions."""

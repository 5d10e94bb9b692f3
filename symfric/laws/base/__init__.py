"""Base classes of laws, and the smooth functions that they are made of."""

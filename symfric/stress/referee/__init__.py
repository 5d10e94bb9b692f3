"""Independent laws, scenes and solver: NumPy, SciPy and the standard library only."""

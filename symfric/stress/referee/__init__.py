"""Independent laws, scenes and solver, using only NumPy, SciPy and the standard library."""

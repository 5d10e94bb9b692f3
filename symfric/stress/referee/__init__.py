"""Laws, scenes and a solver written apart from symfric: NumPy, SciPy and the standard library."""

"""Assessment of a fit: residual tests, intervals, profiles, unidentifiable combinations."""

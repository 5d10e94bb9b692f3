"""Measured records: reading, units, merging, resampling, and checks."""

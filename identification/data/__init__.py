"""Measured records: reading, units, merging, resampling, and what is doubtful about them."""

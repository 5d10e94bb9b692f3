"""Which law for a machine: candidates run on it, ranked by time at equal error."""

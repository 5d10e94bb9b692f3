"""What becomes a block: laws, models, populations, mechanisms."""

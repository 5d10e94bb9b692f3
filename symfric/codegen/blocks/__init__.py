"""Blocks from laws, models, populations and mechanisms."""

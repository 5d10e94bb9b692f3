"""Makes the documentation: pages from the catalogue, formulas, blocks that run, checks."""

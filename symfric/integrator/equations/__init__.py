"""Equations of a model in the form that steps need: unknowns, inputs, constraints, start values."""

"""Equations of a model in the form that a step needs: unknowns, inputs, constraints, start
values.
"""

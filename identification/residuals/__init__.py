"""Residuals of a model on data: points, inverse dynamics, shooting, closed loop."""

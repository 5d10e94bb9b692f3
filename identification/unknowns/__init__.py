"""Fitted parameters: names, bounds, ties, and the coordinates of the fit."""

"""What is fitted: names, bounds, ties, and the coordinates of the fit."""

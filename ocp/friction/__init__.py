"""Optimal control with friction: homotopy, contact modes, verification by event simulation."""

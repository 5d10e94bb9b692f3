"""Optimal control with friction: homotopy, contact modes, verification with exact friction."""

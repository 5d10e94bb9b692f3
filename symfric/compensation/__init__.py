"""Friction compensators and observers as blocks, and their proof in closed loop."""

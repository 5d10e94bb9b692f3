"""Receding horizons: Gauss-Newton on implicit steps, in closed loop and as C."""

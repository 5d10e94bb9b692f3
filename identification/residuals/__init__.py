"""What a model leaves of the data: points, inverse dynamics, motion, closed loop."""

"""From start to end: attempts in a loop, events, dense output, and why a run stopped."""

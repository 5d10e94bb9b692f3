"""What the user writes: phases, conditions, costs, and what they resolve to."""

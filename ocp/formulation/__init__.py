"""Optimal control problems: phases, conditions and costs, their checks and resolved form."""

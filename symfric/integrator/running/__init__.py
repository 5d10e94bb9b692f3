"""Runs of an integrator: attempts in a loop, events, dense output, and failure diagnosis."""

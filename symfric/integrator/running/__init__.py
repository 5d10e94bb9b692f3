"""Runs of an integrator: loops of attempts, events, dense output, and failure diagnosis."""

"""Derivatives of the steps of a run, forward and reverse."""

"""Derivatives of the steps that were taken, forward and reverse."""

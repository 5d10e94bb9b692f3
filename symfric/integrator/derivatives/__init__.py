"""Derivatives of the steps that were taken, forwards and backwards."""

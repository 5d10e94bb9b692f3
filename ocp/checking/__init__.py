"""Verification of an optimised control by re-simulation, error estimates and mesh refinement."""

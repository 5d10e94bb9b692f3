"""Verification of an optimised control by re-simulation, and mesh refinement."""

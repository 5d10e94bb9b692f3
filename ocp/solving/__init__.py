"""Solvers, one solve of a problem on meshes, where it starts, and its solution by name."""

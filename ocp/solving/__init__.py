"""Solvers, single solves on meshes, starting points, and solutions by name."""

"""Solvers, single solves on given meshes, initial guesses, and solutions with named signals."""

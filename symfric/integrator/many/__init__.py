"""Ensembles of runs of one model: members, chunks, programs of workers, stored results."""

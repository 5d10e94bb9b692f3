"""Ensembles of runs of one model: members, chunks, workers, stores."""

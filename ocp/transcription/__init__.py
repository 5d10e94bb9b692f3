"""Transcription of a problem to a nonlinear program, and of its solution to named values."""

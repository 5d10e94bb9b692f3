"""Transcription of a problem to a nonlinear program made of blocks, and back to names."""

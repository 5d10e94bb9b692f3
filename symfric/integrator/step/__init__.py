"""Attempt of an adaptive step as one CasADi Function."""

"""Functional Mock-up Units of models: the adaptive step in C, without CasADi at run time."""

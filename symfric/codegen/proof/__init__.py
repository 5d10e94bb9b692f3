"""Proof that generated C computes what CasADi computes."""

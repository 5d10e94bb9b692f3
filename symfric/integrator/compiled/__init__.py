"""C from CasADi Functions: compiled once, cached, applied to columns of numbers."""

"""C code of CasADi Functions: compiled once, cached, and applied to columns of numbers."""

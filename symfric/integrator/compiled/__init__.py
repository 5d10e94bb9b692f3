"""C from CasADi Functions: compiled once, kept, applied to columns of numbers."""

"""The result of an optimal control problem: it plots, writes and stores itself."""

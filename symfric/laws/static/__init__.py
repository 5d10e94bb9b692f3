"""Memoryless laws F(v, N): one family a file."""

"""Memoryless laws F(v, N), one family per file."""

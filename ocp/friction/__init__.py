"""Homotopy in the widths of friction laws, modes of contacts, and the exact law as referee."""

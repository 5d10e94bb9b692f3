"""Pieces of one HTML page that needs nothing from elsewhere: text, tables, charts, a style."""

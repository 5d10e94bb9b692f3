"""Filters, derivatives and features of measured signals."""

"""Result of a fit, and its numbers as text, JSON and figures."""

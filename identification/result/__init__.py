"""Result of a fit, and its output as text, JSON, page and figures."""

"""What a fit found, and its numbers as text, JSON and pictures."""

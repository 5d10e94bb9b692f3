"""Solution of the weighted least-squares problem from many starts."""

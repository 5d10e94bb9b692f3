"""What a law is, and the only place where it is made smooth."""

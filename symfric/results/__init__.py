"""What a simulation gives back: signals over time that draw, film, balance and save themselves."""

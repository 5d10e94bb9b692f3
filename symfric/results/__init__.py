"""Results of simulations: signals over time that draw, film, balance and save themselves."""

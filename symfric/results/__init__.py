"""Results of simulations: signals over time, with plots, animations, energy balance and files."""

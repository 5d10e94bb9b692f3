"""Integration methods: coefficients with their sources, steps of each family, adaptive attempts."""

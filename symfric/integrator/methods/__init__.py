"""Integration methods: coefficients with their sources, and the steps of each family."""

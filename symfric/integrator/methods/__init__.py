"""Integration methods: coefficients with their source, and the steps of each family."""

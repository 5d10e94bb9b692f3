"""The methods: coefficients with their source, and what each family makes of one step."""

"""Base package: numbers, parameters, units, files, solver status, empty figures."""

"""Base package: argument checks, parameters, units, files, CasADi expressions, empty figures."""

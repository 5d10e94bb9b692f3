"""Ready problems with known optima."""

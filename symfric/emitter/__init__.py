"""CasADi graphs as C statements for controllers, FMUs and graphics processors."""

"""CasADi graphs as statements of C: for controllers, FMUs and graphics processors."""

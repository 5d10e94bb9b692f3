"""Laws composed of laws: sums, wrappers, vectors of slip, populations of contacts."""

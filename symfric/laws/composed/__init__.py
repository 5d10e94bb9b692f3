"""Laws made of laws: sums, wrappers, vectors of slip, populations of contacts."""

"""A model as the step sees it: unknowns, inputs, constraints, start values, linear algebra."""

"""Nonlinear programs to Ipopt, fatrop or an SQP method, and what their answers mean."""

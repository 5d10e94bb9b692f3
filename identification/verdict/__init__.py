"""What a fit is worth: tests of residuals, intervals, profiles, what cannot be told."""

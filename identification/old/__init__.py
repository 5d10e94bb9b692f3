"""The pipelines before `Fit`: they go when it has taken over."""

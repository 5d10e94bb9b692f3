"""One page that shows a fit."""

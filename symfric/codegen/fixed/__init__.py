"""C in fixed point for cores without a floating-point unit, with proven bounds of its error."""

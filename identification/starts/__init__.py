"""Start values from data: Stribeck curves, hysteresis, break-away, Maxwell-slip elements."""

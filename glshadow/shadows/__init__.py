"""Settings of a light's shadow, with their formulas: filter, bias, fit, map format, and the view that a map is drawn from."""

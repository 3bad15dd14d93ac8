"""Settings of a shadow with their formulas: filters, biases, shadow map formats, fits and views."""

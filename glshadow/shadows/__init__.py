"""Settings of a shadow with their formulas: filters, biases, map formats, fits, and the views that they give."""

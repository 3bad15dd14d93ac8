"""Formulas and settings in float64: what a shadow is, with no file, no window and no GPU."""

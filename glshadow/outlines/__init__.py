"""Shadows as polygons in float64. Needs `pip install 'glshadow[outline]'`."""

"""Interactive views, in a notebook and in a window."""

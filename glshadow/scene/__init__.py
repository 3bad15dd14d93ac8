"""Models and built-in scenes: what is drawn."""

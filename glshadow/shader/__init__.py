"""GLSL snippets: their location, and composing them into programs."""

"""GLSL snippets: where they live and how they become one program text."""

"""Every program text that settings can lead to, and whether it is valid GLSL."""

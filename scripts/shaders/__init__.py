"""Every shader that settings can lead to, and checks that it is valid GLSL."""

"""OpenGL itself: contexts, entry points, state, programs, buffers, render targets and queries."""

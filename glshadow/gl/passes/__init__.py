"""Passes of a frame: camera, shadow casters, lighting, antialiasing, read-back."""

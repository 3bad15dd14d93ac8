"""What is derived from settings, scene and camera, in float64: which bodies cast, triangle lists, resolved settings."""

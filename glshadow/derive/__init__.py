"""What is derived from settings, scene and camera, in float64: views of maps, which bodies cast, triangle lists, resolved settings."""

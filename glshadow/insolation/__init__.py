"""Hours of direct sun and irradiance on the surfaces of a scene, over a path of the sun."""

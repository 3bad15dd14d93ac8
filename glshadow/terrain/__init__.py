"""Height fields: digital elevation models, their horizons, and the sun's shadow on them."""

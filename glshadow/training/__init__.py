"""Training data about shadows: a mask for each node's shadow, COCO annotations, images with and without shadows."""

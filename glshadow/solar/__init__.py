"""The sun's position by place and time, and its path through the sky."""

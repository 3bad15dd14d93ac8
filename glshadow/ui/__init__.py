"""What a person turns and changes while looking: in a notebook, and in a window."""

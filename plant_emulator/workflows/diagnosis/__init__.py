"""A whole diagnosis: its runs, what the blind trials taught, its library call, the set to save."""

"""The machines that can be diagnosed: the bench, and a single motor-driven axis."""

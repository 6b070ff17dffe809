"""Measured runs made ready for a fit: preflight checks, weights, noise of the inputs."""

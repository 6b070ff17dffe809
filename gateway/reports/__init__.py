"""Tables and pictures of a replay and of a loss measurement."""

"""One tick of the daemon, pure: supervisor, commands, samples, checks, limits."""

"""The blind trial: effects are hidden, diagnosed from logs alone, unsealed and scored."""

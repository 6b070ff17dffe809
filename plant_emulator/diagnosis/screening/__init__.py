"""What each effect promises on top of a fit, by regressions and by short fits."""

"""The parameter estimation: start values, bounded least squares, initial states, covariance."""

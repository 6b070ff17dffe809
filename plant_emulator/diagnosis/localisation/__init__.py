"""The fault location: parity relations, their covariance, regression on blocks of the model."""

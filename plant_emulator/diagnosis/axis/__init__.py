"""The diagnosis of a single motor-driven axis: parity relations, one regression, a verdict."""

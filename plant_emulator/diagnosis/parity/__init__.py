"""Which effects explain the logs: screened by parity relations, confirmed by simulation."""

"""What the daemon of the tests tells about itself."""

import os

from gateway.monitoring.shared import Identity

IDENTITY = Identity(
    pid=os.getpid(),
    title="bench 1",
    date="2026-01-02T03:04:05.678+00:00",
    period=0.01,
    version="0.2.0",
    recording="runs/1.rlrec",
    real_time="SCHED_FIFO no (Operation not permitted)",
    planned=None,
)

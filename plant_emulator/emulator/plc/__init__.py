"""The emulated PLC: scan, commands, states, ramp, watchdog and faults, without clock or socket."""

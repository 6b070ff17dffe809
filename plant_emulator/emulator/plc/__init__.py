"""The emulated PLC without input or output: scan, commands, state word, ramp, watchdog, faults."""

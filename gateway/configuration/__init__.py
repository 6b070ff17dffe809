"""The configuration as checked records: PLC, loop, truck, regulator, limits."""

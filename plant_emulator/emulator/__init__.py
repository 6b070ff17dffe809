"""The running emulator: clock, Modbus server, process, and the emulated PLC in `plc`."""

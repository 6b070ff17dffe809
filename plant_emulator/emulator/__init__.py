"""The running emulator: clock, Modbus server and process. The emulated PLC is in `plc`."""

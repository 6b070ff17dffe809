"""The Modbus link to the PLC: client, reconnection, checks of every reply, inspection."""

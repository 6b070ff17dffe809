"""The daemon: reads a roller bench over Modbus TCP and sets its speed until it feels like road."""

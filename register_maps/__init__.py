"""Register maps: where in a PLC each signal lives. One TOML file a PLC, found by its file name."""

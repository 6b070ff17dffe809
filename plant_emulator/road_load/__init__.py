"""The identification of a truck and its road load from logs of a road."""

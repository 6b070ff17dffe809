"""The physics: an emulated roller bench with its drive and its PLC, and what explains its logs."""

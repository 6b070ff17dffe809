"""What commands share; no command itself."""

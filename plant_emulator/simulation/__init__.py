"""What is simulated with the model: logs, drive programs, a truck's travel, the running bench."""

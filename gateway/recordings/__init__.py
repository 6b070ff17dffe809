"""Files of runs: recorder process and its screen, recordings, header, export, logs."""

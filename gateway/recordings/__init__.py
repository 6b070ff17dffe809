"""Files of runs: recorder process, recordings, header, export, logs."""

"""What a command does from files to an answer: replay of a run, measurement of the losses."""

"""What a command does from files to answer: reads logs, runs the pure core, dates the result."""

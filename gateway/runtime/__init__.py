"""The running daemon: its loop in real time, its processes."""

"""The recordings: recorder process, screen, file format, header, export, runs of files."""

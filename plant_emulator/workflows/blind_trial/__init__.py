"""Runs a blind trial: the folder with its sealed cases, the diagnoses in processes, the scores."""

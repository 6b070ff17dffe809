"""Logs as both programs read and write them: CSV, Parquet, MDF4, drive programs."""

"""Execution of the tasks of a diagnosis, in this process or in a pool, with progress."""

"""How the tasks of a diagnosis run, in this process or side by side, and report progress."""

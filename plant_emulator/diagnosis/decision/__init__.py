"""The verdict on the effects that the search names, their subsystem, and runs that disagree."""

"""The thesis's equations of the bench: laws, drive, gear, drum, one implicit stage, parameters."""

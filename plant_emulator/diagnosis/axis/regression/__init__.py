"""The equation of motion of an axis as the rows of one linear regression."""

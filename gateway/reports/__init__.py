"""Reports for the operator: lines, tables and pictures of a replay and of the losses."""

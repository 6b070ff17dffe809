"""Files of other programs as logs of an axis: tables, the choice of columns, units."""

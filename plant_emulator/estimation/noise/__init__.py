"""The noise of a measured channel as its log shows it: colour, mains, outliers."""

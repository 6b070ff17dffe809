"""The measured motion of an axis: its kernel, and the smooth curve through the samples."""

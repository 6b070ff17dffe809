"""The design of experiments: detectable effects, and the run that separates hypotheses."""

"""The fit of hypotheses: joint fit, nuisance projection, random effects, evidence."""

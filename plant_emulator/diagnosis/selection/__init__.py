"""Which hypotheses are tested, in which order, and what decides that an effect is named."""

"""Whether the sensors are plausible: the model of the bench against what they show, pure."""

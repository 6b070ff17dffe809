"""The time integration: method, stepper, dead time, and the compilation of model and effects."""

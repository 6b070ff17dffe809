"""The grey-box identification of the bench: fit, report, design of the next experiment."""

"""What cases with known truth taught: confidence of an answer, model-form error of a size."""

"""Sources of the functions and derivatives of custom models."""

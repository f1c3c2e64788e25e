"""Where the functions and derivatives of own models come from."""

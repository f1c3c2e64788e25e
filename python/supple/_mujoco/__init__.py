"""Models of MuJoCo's as the engine wants them."""

"""Adapters from MuJoCo models to the engine."""

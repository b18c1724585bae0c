"""Estimates attitude with and without g-compensation, and finds the effect that the declared model lacks."""

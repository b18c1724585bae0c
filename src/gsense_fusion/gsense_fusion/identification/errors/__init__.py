"""Errors before and after, on runs that were not fitted."""

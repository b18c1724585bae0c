"""Campaigns: the plan of the runs, their simulation, and the index of the bags."""

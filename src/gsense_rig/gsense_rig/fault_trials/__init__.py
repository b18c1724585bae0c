"""Faults put into the simulated rail in mid-run: how soon the output is safe, how far the carriage goes."""

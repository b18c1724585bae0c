"""The sensor's noise, from rest."""

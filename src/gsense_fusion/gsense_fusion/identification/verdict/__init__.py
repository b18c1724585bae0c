"""What may be claimed, and whether anything is left."""

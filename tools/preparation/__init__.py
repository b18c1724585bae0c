"""Set-up of gsense's environment and workspace (standard library only)."""

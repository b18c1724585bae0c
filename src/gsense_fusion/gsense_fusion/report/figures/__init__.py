"""The report's figures: inline SVG with one line each on how to read it."""

from gsense_fusion.report.figures.album import figures
from gsense_fusion.report.figures.canvas import Figure

__all__ = ["Figure", "figures"]

"""Closing the loop: from the runs of a campaign to the effects that the declared model lacks.

The way of a run: `integrity` (uniform grid, losses) -> `motion` (the carriage from the encoder, windows, mounting, delay)
-> `noise` (spectrum at rest) -> `design` (whitened regressors) -> `selection` and `refine` (which effects) -> `sufficiency`
(is anything left) -> `metrics` (errors before and after on held-out runs) -> `verdict`. Runs without a rig go through
`still_poses` instead. No ROS, no files in here.
"""

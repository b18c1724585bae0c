"""Closing the loop: from the runs of a campaign to the effects that the declared model lacks.

The way of a run: `integrity` (uniform grid, losses, sessions) -> `stillness` (without a rig: its still stretches)
-> `campaign` (`motion` from the encoder, `mounting`, delay, windows) -> `rest` and `noise` (spectrum at rest) ->
`likelihood` (fast data `whitened`, `slow` data as `blocks`, one column per parameter of the `effects`) -> `selection`
(which effects) -> `claims` (vetoes; `sufficiency`: is anything left in the `residual`) ->
`folds`, `metrics` (errors before and after on runs not seen) -> `assembly` into a `result`.
`engine` calls them in this order. No ROS, no files in here.
"""

"""The plant's state vector. Imports nothing: the guard process looks at it too."""

from __future__ import annotations

TIME, POSITION, SPEED, CURRENT, ACCELERATION, PULLEY, PULLEY_SPEED = range(7)
SAMPLED_POSITION, SAMPLED_SPEED = 7, 8  # at the last whole millisecond
SWITCH = 9  # four outputs, then four raw levels, then four times of the raw level's last change
STATE_SIZE = SWITCH + 12

"""The plant's state vector. Imports nothing: the guard process looks at it too."""

from __future__ import annotations

TIME, POSITION, SPEED, CURRENT, ACCELERATION, PULLEY, PULLEY_SPEED = range(7)
SWITCH = 7  # four outputs, then four raw levels, then four times of the raw level's last change
STATE_SIZE = SWITCH + 12

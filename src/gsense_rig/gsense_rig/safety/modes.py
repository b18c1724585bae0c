"""Names of modes, faults and lights; the numbers are those of gsense_msgs/RigState."""

from __future__ import annotations

from enum import IntEnum


class Mode(IntEnum):
    """State of the rail's control."""

    UNHOMED = 0
    HOMING = 1
    IDLE = 2
    RUNNING = 3
    STOPPING = 4
    FAULT = 5


class Light(IntEnum):
    """Traffic light: green at rest and ready, amber moving, red fault, off not homed."""

    OFF = 0
    GREEN = 1
    AMBER = 2
    RED = 3


class Fault(IntEnum):
    """Why the rail stopped itself; latched until reset."""

    NONE = 0
    END_SWITCH = 1
    SOFT_LIMIT = 2
    TRACKING = 3
    OVERCURRENT = 4
    STALL = 5
    ENCODER = 6
    HOMING_FAILED = 7
    SWITCH_STUCK = 8
    DEADLINE = 9
    HARDWARE = 10
    EMERGENCY_STOP = 11
    COMMAND_LOST = 12
    BRIDGE = 13
    RUNAWAY = 14
    GUARD = 15


LIGHTS = {
    Mode.UNHOMED: Light.OFF,
    Mode.HOMING: Light.AMBER,
    Mode.IDLE: Light.GREEN,
    Mode.RUNNING: Light.AMBER,
    Mode.STOPPING: Light.AMBER,
    Mode.FAULT: Light.RED,
}

# After these the position is still known: reset leads back to idle without homing.
KEEPS_POSITION = frozenset(
    {
        Fault.OVERCURRENT,
        Fault.DEADLINE,
        Fault.EMERGENCY_STOP,
        Fault.COMMAND_LOST,
        Fault.BRIDGE,
        Fault.TRACKING,
        Fault.GUARD,
    }
)

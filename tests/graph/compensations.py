"""A compensation file with the common factor of the g-sensitivity alone."""

from __future__ import annotations

K = 0.001  # (rad/s)/(m/s^2)


def compensation(sensor: str) -> str:
    """Text of `compensation.yaml` for any unit of a sensor, without bias."""
    return f"""\
schema: gsense-compensation/1
sensor: {sensor}
unit_id: null
bias: {{value: [0.0, 0.0, 0.0], unit: rad/s}}
terms:
- {{effect: g_sensitivity, k: {K}, unit: (rad/s)/(m/s^2)}}
"""

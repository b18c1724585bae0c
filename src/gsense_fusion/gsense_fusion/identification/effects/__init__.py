"""The effects with columns: one file an effect; adding one touches its file and the list below."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.effects.belt_tilt import BearingMode, BeltTilt
from gsense_fusion.identification.effects.belt_tooth import (
    BeltTooth,
    BeltToothAngle,
    BeltToothDouble,
    BeltToothDoubleAngle,
)
from gsense_fusion.identification.effects.bias_jump import BiasJump
from gsense_fusion.identification.effects.friction_pickup import DragPickup, FrictionPickup, InertiaPickup
from gsense_fusion.identification.effects.g_cubed import GCubed
from gsense_fusion.identification.effects.g_resonance import GResonance, RockingMount, SecondMode
from gsense_fusion.identification.effects.g_sensitivity import GSensitivity
from gsense_fusion.identification.effects.g_squared import GSquared
from gsense_fusion.identification.effects.higher_order import higher_order
from gsense_fusion.identification.effects.jerk_coupling import FastMode, JerkCoupling
from gsense_fusion.identification.effects.own_axes import own_axes
from gsense_fusion.identification.effects.rail_curvature import HIGHEST_POWER, RailBend, RailCurvature, wave
from gsense_fusion.identification.effects.reversal_rock import BeltSlack, Contact, ContactLag, ReversalRock
from gsense_fusion.identification.effects.speed_pickup import SpeedPickup
from gsense_fusion.identification.effects.supply_voltage import SupplyVoltage
from gsense_fusion.identification.effects.temperature_bias import TemperatureBias
from gsense_fusion.identification.effects.time_offset import TimeOffset
from gsense_fusion.identification.effects.viscous_tilt import ViscousTilt

REGRESSED: tuple[Effect, ...] = (
    GSensitivity(),
    TemperatureBias(),
    SupplyVoltage(),
    BiasJump(),
    TimeOffset(),
    RailCurvature(),
    RailBend(),
    *(wave(power) for power in range(3, HIGHEST_POWER + 1)),
    SpeedPickup(),
    FrictionPickup(),
    DragPickup(),
    InertiaPickup(),
    GSquared(),
    *own_axes(GSquared()),
    higher_order(GSquared(), 4),
    GCubed(),
    *own_axes(GCubed()),
    higher_order(GCubed(), 5),
    BeltTilt(),
    BearingMode(),
    JerkCoupling(),
    FastMode(),
    *own_axes(JerkCoupling()),
    GResonance(),
    RockingMount(),
    SecondMode(),
    *own_axes(GResonance()),
    ReversalRock(),
    ContactLag(),
    Contact(),
    BeltSlack(),
    BeltTooth(),
    BeltToothAngle(),
    BeltToothDouble(),
    BeltToothDoubleAngle(),
    ViscousTilt(),
)
"""Effects with columns, of equally likely ones the commoner first; `catalogue` adds those of the noise."""

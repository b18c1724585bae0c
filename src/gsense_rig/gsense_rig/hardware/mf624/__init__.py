"""Humusoft MF624 DAQ card through the kernel's UIO driver: registers, mapping, functions, and the rail on it."""

from gsense_rig.hardware.mf624.card import CardPlace, find_card
from gsense_rig.hardware.mf624.rail import CardRailSpec, Mf624Rail
from gsense_rig.hardware.mf624.wiring import Wiring, load_wiring

__all__ = ["CardPlace", "CardRailSpec", "Mf624Rail", "Wiring", "find_card", "load_wiring"]

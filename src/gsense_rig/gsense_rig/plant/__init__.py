"""The simulated rail: motor, gear, belt, carriage, end stops and switches, with their numbers."""

from gsense_rig.plant.parameters import DriveParameters, PlantParameters, SwitchParameters, TrackParameters

__all__ = ["DriveParameters", "PlantParameters", "SwitchParameters", "TrackParameters"]

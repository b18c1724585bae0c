"""Tests of gsense_fusion.calibration."""

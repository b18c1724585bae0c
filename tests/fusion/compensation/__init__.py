"""Tests of gsense_fusion.compensation."""

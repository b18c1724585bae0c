"""Tests of gsense_fusion."""

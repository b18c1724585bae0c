"""Tests of the identification on sessions of an independent simulator (tests/study/simulator) and on real recordings."""

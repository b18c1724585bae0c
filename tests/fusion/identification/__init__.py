"""Tests of the identification: sessions of an independent simulator (tests/study/simulator) and real recordings."""

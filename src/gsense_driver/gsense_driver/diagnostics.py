"""The bridge's health in words, from figures. Pure; levels as in diagnostic_msgs (OK 0, WARN 1, ERROR 2, STALE 3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from gsense_driver.frames import StatusBody
from gsense_driver.link import LinkCounts
from gsense_driver.samples import BNO, LISY, MPU

OK, WARN, ERROR, STALE = 0, 1, 2, 3


class Health(NamedTuple):
    """One entry of `/diagnostics`."""

    task: str
    level: int
    message: str
    values: Mapping[str, str]


@dataclass(frozen=True)
class Figures:
    """What the node measured since the last report (rates) and since its start (counts)."""

    port: str
    port_problem: str | None
    bytes_per_s: float
    frames_per_s: float
    silent_s: float | None  # since the last valid frame; None: there was none
    counts: LinkCounts
    lost_since: int  # since the last report
    corrupt_since: int
    rejects: Mapping[str, int]
    clock_fixed: bool
    clock_skew_ppm: float
    clock_steps: int
    clock_offset_s: float
    held: int
    uptime_s: float
    status: StatusBody | None
    battery_v: float | None
    battery_low: bool
    radio_given_up: int
    i2c_errors: int
    sample_rates: Mapping[str, float]
    failed_since: Mapping[str, int]
    read_failed: Mapping[str, int]
    repeated: int
    repeated_since: int
    calib_stat: int | None = None
    protocol: str = "binary"


def assess(figures: Figures, seen: frozenset[str]) -> list[Health]:
    """Entries for link, clock and each sensor; `seen`: sensors that have given samples since the start."""
    return [_link(figures), _clock(figures), *(_sensor(figures, name, name in seen) for name in (MPU, BNO, LISY))]


def raw_log_health(path: str, written: int, lost: int, problem: str | None) -> Health:
    """Entry for a raw log that is being written."""
    values = {"file": path, "bytes written": str(written), "records lost": str(lost)}
    if problem is not None:
        return Health("raw_log", ERROR, f"no longer written: {problem}", values)
    if lost:
        return Health("raw_log", WARN, f"{lost} records lost: the disk is too slow", values)
    return Health("raw_log", OK, f"{written * 1e-6:.1f} MB written", values)


def _link(f: Figures) -> Health:
    counts = f.counts
    values = {
        "port": f.port,
        "frames per second": f"{f.frames_per_s:.1f}",
        "received": str(counts.received),
        "lost": str(counts.lost),
        "corrupt": str(counts.corrupt),
        "duplicate": str(counts.duplicate),
        "reordered": str(counts.reordered),
        "restarts of the board": str(counts.restarts),
        "radio frames given up (u8)": str(f.radio_given_up),
        "battery": "unknown" if f.battery_v is None else f"{f.battery_v:.3f} V",
        **{f"rejected: {reason}": str(count) for reason, count in sorted(f.rejects.items())},
    }
    if f.status is not None:
        values["firmware"] = f"{f.status.firmware_major}.{f.status.firmware_minor}"
        values["reset cause"] = str(f.status.reset_cause)
    level, message = _link_verdict(f)
    return Health("link", level, message, values)


def _link_verdict(f: Figures) -> tuple[int, str]:
    if f.port_problem is not None:
        return ERROR, f"port is not open: {f.port_problem}"
    if f.silent_s is None or f.silent_s > 1.0:
        return ERROR, _why_silent(f)
    if f.battery_low:
        return WARN, "the board's battery is low"
    if f.lost_since or f.corrupt_since:
        return WARN, f"{f.lost_since} frames lost, {f.corrupt_since} corrupt in the last second"
    return OK, f"{f.frames_per_s:.0f} frames per second"


def _why_silent(f: Figures) -> str:
    if f.bytes_per_s <= 0:
        return "the port is open, but silent: is the board switched on and in reach?"
    if f.rejects.get("version"):
        return "frames of another version arrive: firmware and driver do not match"
    return f"bytes arrive, but no valid frame: is the baud rate or the protocol ({f.protocol}) wrong?"


def _clock(f: Figures) -> Health:
    values = {
        "offset": f"{f.clock_offset_s:.6f} s",
        "skew": f"{f.clock_skew_ppm:.2f} ppm",
        "steps": str(f.clock_steps),
        "frames held for a fix": str(f.held),
        "uptime of the board": f"{f.uptime_s:.1f} s",
    }
    if not f.clock_fixed:
        return Health("clock", WARN, "no fix yet: samples are held back until there is one", values)
    if abs(f.clock_skew_ppm) > 200.0 and f.protocol == "binary":
        return Health(
            "clock", WARN, f"the board's clock runs {f.clock_skew_ppm:+.0f} ppm off: is its crystal sound?", values
        )
    return Health("clock", OK, f"skew {f.clock_skew_ppm:+.1f} ppm", values)


def _expected_rate(f: Figures, sensor: str) -> float | None:
    if f.status is None:
        return None
    period = f.status.bno_period_us if sensor == BNO else f.status.mpu_period_us
    return 1e6 / period if period else None


def _sensor(f: Figures, sensor: str, seen: bool) -> Health:
    rate = f.sample_rates.get(sensor, 0.0)
    failed = f.failed_since.get(sensor, 0)
    values = {"samples per second": f"{rate:.1f}", "failed reads": str(f.read_failed.get(sensor, 0))}
    if sensor == BNO:
        values["repeated samples"] = str(f.repeated)
        if f.calib_stat is not None:
            names = ("system", "gyro", "accelerometer", "magnetometer")
            levels = (f"{name} {f.calib_stat >> shift & 3}" for name, shift in zip(names, (6, 4, 2, 0), strict=True))
            values["calibration (0 to 3)"] = ", ".join(levels)
    else:
        values["I2C errors (u8)"] = str(f.i2c_errors)
    expected = _expected_rate(f, sensor)
    if rate == 0.0 and failed:
        return Health(
            sensor, ERROR, f"every read fails ({failed} in the last second): check its supply and the I2C bus", values
        )
    if rate == 0.0:
        return Health(sensor, ERROR if seen else STALE, "no samples" if seen else "no samples so far", values)
    if failed:
        return Health(sensor, WARN, f"{failed} reads failed in the last second", values)
    if expected is not None and rate < 0.9 * expected:
        return Health(sensor, WARN, f"{rate:.0f} of {expected:.0f} samples per second", values)
    if sensor == BNO and rate and f.repeated_since > 0.5 * rate:
        return Health(
            sensor, WARN, f"{f.repeated_since} of {rate:.0f} samples are repeated: it is polled too fast", values
        )
    return Health(sensor, OK, f"{rate:.0f} samples per second", values)

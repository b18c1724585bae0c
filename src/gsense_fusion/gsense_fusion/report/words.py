"""What the report says: the verdict in one sentence, what to correct, and which run would decide."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi

from gsense_fusion.identification.analysis import UNDECIDED
from gsense_fusion.identification.errors.metrics import Rms
from gsense_fusion.identification.result import EFFECTS_FOUND, NOTHING_MISSING, Finding, LoopResult, Unexplained
from gsense_fusion.identification.types import Owner, Parameter
from gsense_fusion.report.units import DEG, interval, number, probability, together

OWNER_NAMES = {
    Owner.SENSOR: "sensor",
    Owner.MOUNT: "mount",
    Owner.RIG: "rig",
    Owner.CHAIN: "chain",
    Owner.REFERENCE: "reference",
}
CORRECTIONS = {
    Owner.SENSOR: "compensate the sensor: compensation.yaml holds what the fusion node subtracts from the gyro",
    Owner.MOUNT: "fix the mount: the board moves against the carriage",
    Owner.RIG: "correct the rig's reference attitude, not the gyro: the carriage truly turns, and the gyro is right",
    Owner.CHAIN: "fix supply, wiring or radio between sensor and host, not the sensor",
    Owner.REFERENCE: "correct the encoder's scale, not the gyro",
}
TIMING = "fix the timing: gyro and accelerometer are not read at the same instant (the fusion node can shift the gyro)"
SEPARATING_RUNS = {
    "board_turned_180": "the same runs with the board turned by 180 degrees about the vertical: seen in the sensor's "
    "axes, what belongs to the rig turns, and what belongs to the sensor stays",
    "board_turned_90": "the same runs with the board turned by 90 degrees: on its side, about the rail, where the rig "
    "may turn, else about the vertical",
    "supply_toggled": "a run at rest with the supply voltage toggled",
    "temperature_soak": "a long run at rest while the board warms up and cools down by 10 K",
    "motor_beside_board": "the motor moving with the board lying still beside it",
    "long_rest": "two hours at rest",
    "small_stroke": "the same frequencies with a stroke of 0.05 m",
}
BADGES = {EFFECTS_FOUND: "effects found", NOTHING_MISSING: "nothing is missing"}
HEADING = "heading"
LEVEL = 0.02
"""Errors that differ by less than this part are called equal."""


def one_sentence(result: LoopResult) -> str:
    """The verdict with its numbers, in plain ASCII for a terminal (the page writes +- as one sign)."""
    lacking = " and ".join(_finding(f) for f in result.findings)
    if result.unexplained is not None:
        head = _unexplained(result.unexplained)
        if lacking:
            head = f"the declared model lacks {lacking}, and beyond that {head}"
    elif lacking:
        head = f"the declared model lacks {lacking}"
    else:
        head = f"nothing is missing from the declared model ({', '.join(result.declared) or 'empty'})"
    return f"{sensor_name(result)}: {head}: {_change(result)}."


def sensor_name(result: LoopResult) -> str:
    """Sensor and, where known, the unit."""
    return result.sensor if result.unit_id is None else f"{result.sensor} {result.unit_id}"


def badge(result: LoopResult) -> str:
    """The verdict in a few words."""
    if result.verdict in BADGES:
        return BADGES[result.verdict]
    return "effects found, and something unexplained" if result.findings else "something is unexplained"


def correction(finding: Finding) -> str:
    """What a person should correct."""
    if finding.advice:
        return finding.advice
    if finding.owner is Owner.CHAIN and any(p.unit == "s" for p in finding.parameters.values()):
        return TIMING
    return CORRECTIONS[finding.owner]


def separating_run(name: str) -> str:
    """A separating run in words."""
    return SEPARATING_RUNS.get(name, name.replace("_", " "))


def lead_parameter(finding: Finding) -> tuple[str, Parameter] | None:
    """The parameter of a finding to quote: of a magnetic one what it does to the heading."""
    if HEADING in finding.parameters:
        return HEADING, finding.parameters[HEADING]
    return lead_of(finding.parameters)


def lead_of(parameters: Mapping[str, Parameter]) -> tuple[str, Parameter] | None:
    """The parameter to quote: the largest significant one of the unit that is surest; None where no error is known."""
    known = [(n, p) for n, p in parameters.items() if p.stderr > 0.0]
    if not known:
        return None
    surest = max(known, key=lambda item: abs(item[1].value) / item[1].stderr)
    alike = [item for item in known if item[1].unit == surest[1].unit and item[1].significant]
    return max(alike, key=lambda item: abs(item[1].value), default=surest)


def grouped(undecided: Sequence[str]) -> list[str]:
    """What could not be decided, effects with the same reason in one line, in the order of the first of each."""
    effects: dict[str, list[str]] = {}
    for line in undecided:
        name, _, reason = line.partition(f" {UNDECIDED}: ")
        effects.setdefault(f" {UNDECIDED}: {reason}" if reason else line, []).append(name if reason else "")
    return [f"{', '.join(names)}{reason}" for reason, names in effects.items()]


def has_motion(result: LoopResult) -> bool:
    """Whether any run moved along the rail."""
    return any(r.angular_frequency is not None or r.amplitude for r in result.runs)


def judged_on(result: LoopResult) -> str:
    """Which data the errors are from."""
    if any(r.role == "held_out" for r in result.runs):
        return "on runs it had not seen"
    return "on each run left out in turn" if len(result.runs) > 1 else "on each part left out in turn"


def headline_rms(result: LoopResult) -> tuple[str, Rms]:
    """The error that counts, with its name: the rate below 5 Hz on a rail, the means of still stretches without one."""
    if result.pose_rms is not None and not has_motion(result):
        return "the error of the mean rate at rest", result.pose_rms
    return "the rate error below 5 Hz", result.rate_rms


def hertz(angular_frequency: float) -> str:
    """An angular frequency in Hz."""
    return f"{number(angular_frequency / (2 * pi))} Hz"


def _finding(finding: Finding) -> str:
    lead = lead_parameter(finding)
    value = "" if lead is None else f"{lead[0]} = {interval(lead[1], lead[0])}, "
    text = f"{finding.effect} ({OWNER_NAMES[finding.owner]}; {value}{probability(finding.p_value)})"
    return text if not finding.alternatives else f"{text} or {' or '.join(finding.alternatives)}"


def _unexplained(unexplained: Unexplained) -> str:
    where = f" on {', '.join(unexplained.axes)}" if unexplained.axes else ""
    size = f"{number(unexplained.rate_rms * DEG, 2)} deg/s"
    text = f"something is there that no effect of the catalogue explains ({size}{where}"
    if unexplained.frequencies:
        text += f", strongest at {hertz(unexplained.frequencies[0])}"
    return text + (f"; nearest is {unexplained.nearest_effects[0]})" if unexplained.nearest_effects else ")")


def _change(result: LoopResult) -> str:
    name, rms = headline_rms(result)
    floor = [] if rms.noise_floor is None else [rms.noise_floor]
    raw, declared, full, *rest = together(*(v * DEG for v in (rms.raw, rms.declared, rms.full, *floor)))
    noise = f", the noise floor being {rest[0]}" if rest else ""
    if not result.findings:
        return f"{judged_on(result)}, {name} is {declared} deg/s ({raw} with the bias alone){noise}"
    if all(HEADING in f.parameters for f in result.findings):
        return f"the heading suffers, the gyro does not; {judged_on(result)}, {name} is {declared} deg/s{noise}"
    return f"{judged_on(result)}, {name} {_verb(rms.declared, rms.full)} {_from_to(declared, full)} deg/s{noise}"


def _verb(before: float, after: float) -> str:
    if abs(after - before) <= LEVEL * before:
        return "stays, going"
    return "falls" if after < before else "rises"


def _from_to(before: str, after: str) -> str:
    return f"from {before} to {after}"


def listing(names: Sequence[str]) -> str:
    """Names in a row: "a, b and c"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else list(names))

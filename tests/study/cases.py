"""The sessions of the study: nulls, single effects and pairs on a ladder of energies, effects outside the catalogue."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .simulator import Disturbance, SessionParameters, simulate, sweep_plan, turned_plan, whitened_energy
from .simulator.disturbances import BESIDE, NAMED, OUTSIDE, TURNED_ONLY
from .simulator.energy import scaled
from .simulator.parameters import ChainParameters, NoiseParameters, ThermalParameters

SINGLES = tuple(k for k in NAMED if k not in TURNED_ONLY)
PAIRS = (
    ("temperature_bias", "rail_curvature"),
    ("rail_curvature", "time_offset"),
    ("temperature_bias", "time_offset"),
    ("rectification", "rail_curvature"),
    ("brush_current", "temperature_bias"),
    ("feedthrough", "hard_spring"),
    ("bearing_play", "rail_curvature"),
    ("back_emf", "rectification"),
)
LEVELS = (40.0, 400.0, 4000.0, 40_000.0)


@dataclass(frozen=True)
class Case:
    """One session to be judged."""

    group: str
    """null, single, pair or outside."""
    kinds: tuple[str, ...]
    energy: float
    seed: int
    rate_hz: float = 200.0
    plan: str = "sweep"
    """sweep (one mounting), or turned (the minimum plan with the board turned)."""

    @property
    def names(self) -> frozenset[str]:
        """What the catalogue calls the disturbances; empty for what it cannot name."""
        return frozenset(NAMED[k] for k in self.kinds if k in NAMED)

    @property
    def beside(self) -> frozenset[str]:
        """What may be named beside them."""
        return frozenset(n for k in self.kinds for n in BESIDE.get(k, ()))

    @property
    def label(self) -> str:
        return " + ".join(self.kinds) or "null"


def parameters(case: Case) -> SessionParameters:
    """The session's parameters, everything but the disturbances drawn from its seed alone."""
    rng = np.random.default_rng([case.seed, 77])
    base = NoiseParameters()
    return SessionParameters(
        seed=case.seed,
        plan=turned_plan(case.seed) if case.plan == "turned" else sweep_plan(case.seed),
        rail_shape="spline" if case.seed % 3 == 0 else "arc",
        noise=replace(
            base, white=base.white * float(rng.uniform(0.8, 1.3)), relaxation=base.relaxation * rng.uniform(0, 1.5)
        ),
        thermal=ThermalParameters(
            board_rise_k=float(rng.uniform(3, 9)),
            board_tau_s=float(rng.uniform(80, 250)),
            element_tau_s=float(rng.uniform(1, 8)),
            warm_for_s=float(rng.uniform(5, 200)),
        ),
        chain=ChainParameters(
            rate_hz=case.rate_hz,
            filter_hz=min(42.0, 0.45 * case.rate_hz),
            clock_ppm=float(rng.uniform(-80, 80)),
            loss=float(rng.choice([0.0, 0.0, 0.002])),
        ),
    )


def with_disturbances(case: Case) -> SessionParameters:
    """The parameters with the case's disturbances at its energy (each of a pair alone has it).

    A delay stays between 10 and 50 ms, as in the field: its energy comes by the size of G.
    """
    bare = parameters(case)
    found: list[Disturbance] = []
    if "time_offset" in case.kinds:
        delay = Disturbance("time_offset", float(np.random.default_rng([case.seed, 78]).uniform(0.01, 0.05)))
        energy = whitened_energy(simulate(replace(bare, disturbances=(delay,))), simulate(bare))
        bare = replace(bare, g_typical=bare.g_typical * float(np.sqrt(case.energy / energy)))
        found.append(delay)
    found += [scaled(bare, kind, case.energy)[0] for kind in case.kinds if kind != "time_offset"]
    return replace(bare, disturbances=tuple(found))


def make_cases(nulls: int, each: int, rate_hz: float = 200.0, first_seed: int = 0, plan: str = "sweep") -> list[Case]:
    """`nulls` sessions without, `each` per effect and energy with something undeclared; in random order."""
    cases = [Case("null", (), 0.0, first_seed + 10_000 + i, rate_hz, plan) for i in range(nulls)]
    everything = [(k,) for k in SINGLES] + list(PAIRS) + [(k,) for k in OUTSIDE]
    everything += [(k,) for k in TURNED_ONLY if plan == "turned"]
    for number, kinds in enumerate(everything):
        group = "pair" if len(kinds) == 2 else "single" if kinds[0] in NAMED else "outside"
        levels = LEVELS if group == "single" else LEVELS[1:]
        for i, energy in enumerate(levels):
            seeds = range(
                first_seed + 20_000 + 1000 * number + 200 * i, first_seed + 20_000 + 1000 * number + 200 * i + each
            )
            cases += [Case(group, kinds, energy, seed, rate_hz, plan) for seed in seeds]
    order = np.random.default_rng(first_seed).permutation(len(cases))
    return [cases[i] for i in order]


def quick_cases() -> list[Case]:
    """What `--quick` judges: nulls at two rates, clear effects of motion, rail and temperature, one unknown."""
    nulls = [Case("null", (), 0.0, 10_000 + i, rate) for i, rate in enumerate((200.0, 100.0, 25.0))]
    kinds = ("rail_curvature", "temperature_bias", "rectification")
    singles = [Case("single", (k,), 4000.0, 20_001 + i, 100.0) for i, k in enumerate(kinds)]
    return [*nulls, *singles, Case("outside", ("air_drag",), 4000.0, 30_001, 100.0)]

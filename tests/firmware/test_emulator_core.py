"""The emulated core against gpsim's PIC16F1788, instruction by instruction, on random programs."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from tests.firmware.pic_program import CALLW, MOVLB_1788, MOVLB_15356, MOVWF_PCL, SKIPS_D, intel_hex, program

STEPS = 1200
FIRST_LINE = re.compile(r"^0x([0-9A-F]{16}) p16f1788 0x([0-9A-F]{4}) 0x([0-9A-F]{4})")
WRITE = re.compile(r"^  Wrote: 0x([0-9A-F]{4}) to \S+?\(0x([0-9A-F]{4})\)")
STATUS, FSR, BSR, WREG, PCLATH = 3, 4, 8, 9, 10
WATCHDOG_OFF = {0x8007: 0x3F8F, 0x8009: 0x3F9F}
WATCHDOG_OFF_1788 = {0x8007: 0x3FE4, 0x8008: 0x1FFF}


def as_gpsim_shows(states: list[tuple[int, ...]], step: int, words: list[int]) -> tuple[int, ...]:
    """gpsim's trace shows CALLW and MOVWF PCL one cycle late and before its target, a skip and a read of
    program memory one cycle late."""
    cycle, pc, *core = states[step]
    word = words[pc]
    next_cycle, next_pc = states[step + 1][:2]
    if word in (CALLW, MOVWF_PCL):
        return (cycle + 1, next_pc - 1, *core)
    may_take_two = word >> 11 == 0b011 or word >> 8 in (*SKIPS_D, 0x3F) or word >> 3 == 0b10  # the last two: MOVIW
    return (cycle + 1 if may_take_two and next_cycle == cycle + 2 else cycle, pc, *core)


@dataclass
class Gpsim:
    """The states before each instruction, and the data memory at the end, from gpsim's trace of what was written."""

    states: list[tuple[int, ...]] = field(default_factory=list)
    memory: dict[int, int] = field(default_factory=lambda: {STATUS: 0x18})

    def read(self, text: str) -> Gpsim:
        for line in text.splitlines():
            if head := FIRST_LINE.match(line):
                self.states.append((int(head[1], 16), int(head[2], 16), *self.core()))
            elif wrote := WRITE.match(line):
                at = int(wrote[2], 16)
                self.memory[at if at % 0x80 < 0x70 and at % 0x80 >= 12 else at % 0x80] = int(wrote[1], 16)
        return self

    def core(self) -> tuple[int, ...]:
        m = self.memory
        fsr = [m.get(FSR + 2 * n, 0) | m.get(FSR + 2 * n + 1, 0) << 8 for n in (0, 1)]
        return (m.get(WREG, 0), m[STATUS], m.get(BSR, 0), *fsr, m.get(PCLATH, 0))

    def ram(self) -> bytes:
        linear = [self.memory.get(i // 80 * 0x80 + 0x20 + i % 80, 0) for i in range(2032)]
        return bytes(linear + [self.memory.get(0x70 + i, 0) for i in range(16)])


def run_gpsim(folder: Path, words: list[int]) -> Gpsim:
    (folder / "reference.hex").write_text(intel_hex(words, WATCHDOG_OFF_1788))
    done = subprocess.run(
        ["gpsim", "-i", "-pp16f1788", "reference.hex"],
        cwd=folder, input="step 1\n" * STEPS + "quit\n", capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    return Gpsim().read(done.stdout)


def run_emulator(binary: Path, folder: Path, words: list[int]) -> tuple[list[tuple[int, ...]], bytes]:
    (folder / "ours.hex").write_text(intel_hex(words, WATCHDOG_OFF))
    command = [str(binary), str(folder / "ours.hex"), str(STEPS)]
    lines = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout.splitlines()
    states = [(int(cycle), *(int(value, 16) for value in rest)) for cycle, *rest in map(str.split, lines[:-1])]
    return states, bytes.fromhex(lines[-1])


@pytest.mark.parametrize(
    "seed", [seed if seed < 4 else pytest.param(seed, marks=pytest.mark.slow) for seed in range(40)]
)
def test_core_does_what_gpsim_does(firmware_build: Path, tmp_path: Path, seed: int) -> None:
    if shutil.which("gpsim") is None:
        pytest.skip("gpsim is missing: apt-get install gpsim")
    binary = firmware_build / "tests" / "pic_trace"
    if not binary.exists():
        pytest.skip("cmocka is missing, so the C tests were not built")
    words = program(seed, MOVLB_15356)
    ours, ram = run_emulator(binary, tmp_path, words)
    gpsim = run_gpsim(tmp_path, program(seed, MOVLB_1788))
    assert len(gpsim.states) == STEPS
    for step in range(STEPS - 1):
        assert as_gpsim_shows(ours, step, words) == gpsim.states[step], f"step {step}, after {ours[step - 1][1]:#06x}"
    assert ram == gpsim.ram()

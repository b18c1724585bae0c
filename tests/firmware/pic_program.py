"""Random programs for the enhanced mid-range core, as words, and Intel hex of them.

Encodings are those of the instruction set summary in data sheet DS40001866 (PIC16(L)F15356) and, for MOVLB alone,
DS40001675 (PIC16(L)F1788): there it has 5 bits of bank and another opcode.
"""

from __future__ import annotations

import random
from collections.abc import Callable

BYTE_D = (0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0A, 0x0C, 0x0D, 0x0E, 0x35, 0x36, 0x37, 0x3B, 0x3D)
SKIPS_D = (0x0B, 0x0F)  # DECFSZ, INCFSZ
LITERALS = (0x30, 0x38, 0x39, 0x3A, 0x3C, 0x3E)
CORE = (0x04, 0x06, 0x09)  # FSR0L, FSR1L, WREG; gpsim's STATUS and BSR have other bits than the chip's
INDIRECT = (0x00, 0x01)
SUBROUTINES = 0x800
SUB_WORDS = 16
SUBS = 8
RETURN, CALLW, BRW, NOP, CLRW = 0x0008, 0x000A, 0x000B, 0x0000, 0x0103
MOVLB_15356, MOVLB_1788 = 0x0140, 0x0020
BANKS = 20  # both chips have 80 bytes of RAM in each of these
MOVWF_PCL, FSR_HIGH = 0x0082, (5, 7)


class Writer:
    """Words of one program; `movlb` is the chip's opcode."""

    def __init__(self, seed: int, movlb: int) -> None:
        self.dice = random.Random(seed)
        self.movlb = movlb
        self.words: dict[int, int] = {}
        self.at = 0

    def put(self, *words: int) -> None:
        for word in words:
            self.words[self.at] = word
            self.at += 1

    def set_bank(self) -> None:
        self.put(self.movlb | self.dice.randrange(BANKS))

    def set_fsr(self) -> None:
        """FSR n into linear RAM, with room on both sides for what follows."""
        self.point(self.dice.randrange(2), 0x21 + self.dice.randrange(4), self.dice.randrange(256))

    def point(self, n: int, high: int, low: int) -> None:
        self.put(0x3000 | high, 0x0080 | FSR_HIGH[n], 0x3000 | low, 0x0084 + 2 * n)

    def file(self) -> int:
        kind = self.dice.random()
        if kind < 0.75:
            return self.dice.randrange(0x20, 0x80)
        return self.dice.choice(CORE if kind < 0.9 else INDIRECT)

    def plain(self) -> None:
        """One instruction that goes on with the next one."""
        d = self.dice.randrange(2) << 7
        pick = self.dice.random()
        if pick < 0.45:
            self.one_file(self.dice.choice(BYTE_D) << 8 | d)
        elif pick < 0.65:
            self.put(self.dice.choice(LITERALS) << 8 | self.dice.randrange(256))
        elif pick < 0.75:
            self.one_file(self.dice.choice((0x1000, 0x1400)) | self.dice.randrange(8) << 7)
        elif pick < 0.83:
            self.one_file(self.dice.choice((0x0080, 0x0180)))
        elif pick < 0.90:
            self.put(self.dice.choice((0x0010, 0x0018)) | self.dice.randrange(8))
        elif pick < 0.96:
            self.put(self.dice.choice((0x3F00, 0x3F80)) | self.dice.randrange(128) & 0x7F)
        else:
            self.put(self.dice.choice((NOP, CLRW)))

    def one_file(self, word: int) -> None:
        self.put(word | self.file())

    def skip(self) -> None:
        f = self.dice.randrange(0x20, 0x80)
        if self.dice.random() < 0.5:
            self.put(self.dice.choice(SKIPS_D) << 8 | self.dice.randrange(2) << 7 | f)
        else:
            self.put(self.dice.choice((0x1800, 0x1C00)) | self.dice.randrange(8) << 7 | f)
        self.put(self.dice.choice(LITERALS) << 8 | self.dice.randrange(256))

    def call(self) -> None:
        target = SUBROUTINES + self.dice.randrange(SUBS) * SUB_WORDS
        if self.dice.random() < 0.5:
            self.put(0x3180 | target >> 8, 0x2000 | target & 0x7FF)
        else:
            self.put(0x3180 | target >> 8, 0x3000 | target & 0xFF, CALLW)

    def jump(self) -> None:
        """Over a few words, by each of the ways there are."""
        over = self.dice.randrange(4)
        target = self.at + 2 + over
        ways: list[Callable[[], None]] = [
            lambda: self.put(NOP, 0x3200 | over),  # BRA
            lambda: self.put(0x3000 | over, BRW),
            lambda: self.put(0x3180, 0x2800 | target),  # MOVLP 0, GOTO
        ]
        self.dice.choice(ways)()
        for _ in range(over):
            self.put(self.dice.choice(LITERALS) << 8 | self.dice.randrange(256))

    def computed(self) -> None:
        """MOVWF PCL, ADDWF PCL and program memory through an FSR."""
        if self.dice.random() < 0.5:
            target = self.at + 5
            self.put(0x3180 | target >> 8, 0x3000 | target & 0xFF, MOVWF_PCL, NOP, NOP)
        else:
            n = self.dice.randrange(2)
            self.point(n, 0x80, self.dice.randrange(3))
            self.put(0x3F00 | n << 6, 0x0010 | n << 2 | 2)
            self.set_fsr()
            self.put(0x3021, 0x0080 | FSR_HIGH[n])

    def fsr_steps(self) -> None:
        self.set_fsr()
        for _ in range(self.dice.randrange(4)):
            self.put(0x3100 | self.dice.randrange(2) << 6 | self.dice.randrange(64))


def program(seed: int, movlb: int, words: int = 700) -> list[int]:
    """A main line of about `words` words that ends in a jump to itself, and subroutines behind it."""
    w = Writer(seed, movlb)
    for n in (0, 1):
        w.put(0x3022, 0x0080 | FSR_HIGH[n])
    moves = (w.plain, w.plain, w.plain, w.plain, w.plain, w.skip, w.call, w.jump, w.computed, w.fsr_steps, w.set_bank)
    while w.at < words:
        w.dice.choice(moves)()
    w.put(0x3180 | w.at >> 8, 0x2800 | (w.at + 1))
    for sub in range(SUBS):
        w.at = SUBROUTINES + sub * SUB_WORDS
        for _ in range(w.dice.randrange(6)):
            w.plain()
        w.put(w.dice.choice((RETURN, 0x3400 | w.dice.randrange(256))))
    return [w.words.get(at, 0x3FFF) for at in range(max(w.words) + 1)]


def intel_hex(words: list[int], config: dict[int, int] | None = None) -> str:
    """Words from address 0 on, and configuration words by their address."""
    lines: list[str] = []

    def record(address: int, kind: int, data: bytes) -> None:
        body = bytes((len(data), address >> 8 & 0xFF, address & 0xFF, kind)) + data
        lines.append(f":{(body + bytes((-sum(body) & 0xFF,))).hex().upper()}")

    for at in range(0, len(words), 8):
        record(2 * at, 0, b"".join(word.to_bytes(2, "little") for word in words[at : at + 8]))
    if config:
        record(0, 4, b"\0\1")
        for at, word in config.items():
            record(2 * at & 0xFFFF, 0, word.to_bytes(2, "little"))
    record(0, 1, b"")
    return "\n".join(lines) + "\n"

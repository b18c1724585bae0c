"""The two programs for the PIC16F15356: from the sources to hex, map and sizes."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from frames import own_locals
from toolchain import HERE, Toolchain

FIRMWARE = HERE.parent
CORE = FIRMWARE / "core"
RECEIVER = FIRMWARE / "receiver"
CHIP = FIRMWARE / "hal" / "pic16f15356"
FLASH_WORDS = 16384
RAM_BYTES = 2048
DEVICE = "16f15356"
# gpasm's id of the processor, and that of the 16F1788, whose core gplink 1.4 takes for the same.
PROCESSOR_OFFSET = 0x1A
PROCESSOR = b"\x90\xa2"
PROCESSOR_FOR_GPLINK = b"\x88\xa7"
ASSEMBLER_PARTS = ("memory", "arithmetic", "bursts", "conversions")
# Of SDCC's library, what assembler_parts do not bring: the linker takes what is called.
LIBRARY_C = (
    *("pic14/libsdcc/idata", "pic14/libsdcc/_mullong", "_divulong", "_divslong", "_modulong", "_modslong"),
    *("_divuint", "_moduint", "_divsint", "_modsint"),
)


class BuildError(RuntimeError):
    """A tool refused a source; the text is its message."""


@dataclass(frozen=True)
class Program:
    """One hex file.

    Attributes:
        portable: sources that go through specialise.py together, without suffix.
        chip: sources of the HAL that belong to this program, without suffix.
        split: the program's state and its type.
        far: members of the state larger than a bank, at linear addresses; `far_bytes` is their size.
        defines: macros for `portable`.
    """

    name: str
    portable: tuple[Path, ...]
    chip: tuple[str, ...]
    split: tuple[str, str]
    far: dict[str, int] = field(default_factory=dict)
    far_bytes: int = 0
    defines: tuple[str, ...] = ()


@dataclass(frozen=True)
class Built:
    """A program's files and sizes."""

    name: str
    hex: Path
    map: Path
    flash_words: int
    ram_bytes: int


def _board(name: str, profile: str) -> Program:
    core = tuple(CORE / file.stem for file in sorted(CORE.glob("*.c")) if file.stem != "crc16")  # arithmetic.asm has it
    return Program(
        name,
        (*core, CHIP / "program_board"),
        ("main_board", "chip", "registers", "spi_radio", "i2c_bus", "adc"),
        ("the_board", "board"),
        defines=(f"BOARD_PROFILE={profile}",),
    )


PROGRAMS = (
    _board("board", "board_profile_default"),
    _board("board_fast", "board_profile_fast"),
    Program(
        "receiver",
        (CORE / "nrf24", CORE / "profiles", RECEIVER / "receiver", RECEIVER / "cobs", CHIP / "program_receiver"),
        ("main_receiver", "chip", "registers", "spi_radio", "serial"),
        ("the_receiver", "receiver"),
        far={"ring": 0x2000},
        far_bytes=40 * 32,
    ),
)


class Builder:
    """Builds programs in a folder; the library is made once."""

    def __init__(self, tools: Toolchain, out: Path) -> None:
        self.tools = tools
        self.out = out
        sys.path.insert(0, str(tools.python))
        (out / "work").mkdir(parents=True, exist_ok=True)
        self.library = self._library()

    def build(self, program: Program) -> Built:
        """Raises: BuildError."""
        work = self.out / "work" / program.name
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir(parents=True)
        source = work / f"{program.name}.c"
        source.write_text(self._specialised(program))
        objects = [self._compile(source, work, own=True)]
        objects += [self._compile(CHIP / f"{name}.c", work, own=True) for name in program.chip]
        for made in objects:
            _patch(made)
        made = work / f"{program.name}.hex"
        script = work / "script.lkr"
        script.write_text(linker_script((HERE / "pic16f15356.lkr").read_text(), program.far_bytes))
        command = ["gplink", "-q", "-m", "-c", "-w", "-s", str(script), "-o", str(made)]
        self._run([*command, *map(str, objects), str(self.library)])
        placed = [Path(shutil.copy2(file, self.out / file.name)) for file in (made, made.with_suffix(".map"))]
        words = read_hex(placed[0])
        return Built(
            program.name,
            placed[0],
            placed[1],
            sum(address < FLASH_WORDS for address in words),
            ram_of(placed[1].read_text()) + program.far_bytes,
        )

    def _specialised(self, program: Program) -> str:
        from propagation import Program as Whole  # noqa: PLC0415 the parser lies in the tools' folder
        from specialise import specialise  # noqa: PLC0415
        from units import Split, parse  # noqa: PLC0415

        includes = [f"-I{folder}" for folder in (HERE / "headers", CORE, RECEIVER, CHIP)]
        defines = [f"-D{define}" for define in ("__SDCC", *program.defines)]
        units = []
        for file in program.portable:
            command = ["sdcpp", "-P", "-nostdinc", *includes, *defines, str(file.with_suffix(".c"))]
            units.append(parse(file.name, self._run(command)))
        return specialise(Whole(units, Split(*program.split, far=program.far), "program_run"))

    def _compile(self, source: Path, work: Path, own: bool) -> Path:
        assembler = work / f"{source.stem}.asm"
        device = self.tools.device / "include"
        folders = (HERE, device / "pic14", device, CORE, RECEIVER, CHIP)
        command = ["sdcc", "-mpic14", f"-p{DEVICE}", "--std-c99", "--use-non-free", "--nostdinc", "--nostdlib"]
        command += ["--less-pedantic", *(f"-I{folder}" for folder in folders), "-S", str(source), "-o", str(assembler)]
        self._run(command)
        if own:
            assembler.write_text(own_locals(assembler.read_text()))
        return self._assemble(assembler, work)

    def _assemble(self, source: Path, work: Path, *folders: Path) -> Path:
        made = work / f"{source.stem}.o"
        includes = [f"-I{folder}" for folder in (*folders, self.tools.assembler_headers)]
        self._run(["gpasm", "-q", "-c", "-p", DEVICE, *includes, str(source), "-o", str(made)])
        return made

    def _library(self) -> Path:
        work = self.out / "work" / "library"
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir()
        sources = self.tools.device / "lib"
        objects = [self._compile(sources / f"{name}.c", work, own=False) for name in LIBRARY_C]
        objects += [self._assemble(CHIP / f"{name}.asm", work) for name in ASSEMBLER_PARTS]
        pointers = sources / "pic14" / "libsdcc" / "enhanced"
        for file in sorted(pointers.glob("*.S")):
            copy = work / f"{file.stem}.asm"
            shutil.copyfile(file, copy)
            objects.append(self._assemble(copy, work, pointers, self.tools.device / "include" / "pic14"))
        for made in objects:
            _patch(made)
        library = work / "library.a"
        self._run(["gplib", "-q", "-c", str(library), *map(str, objects)])
        return library

    def _run(self, command: list[str]) -> str:
        done = subprocess.run(command, env=self.tools.environment(), capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise BuildError(f"{' '.join(command)}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
        return done.stdout


def _patch(made: Path) -> None:
    data = bytearray(made.read_bytes())
    if data[PROCESSOR_OFFSET : PROCESSOR_OFFSET + 2] == PROCESSOR:
        data[PROCESSOR_OFFSET : PROCESSOR_OFFSET + 2] = PROCESSOR_FOR_GPLINK
        made.write_bytes(data)


def linker_script(text: str, far_bytes: int) -> str:
    """The script without the banks that linear memory from 0x2000 on takes."""
    taken = (far_bytes + 79) // 80
    return re.sub(
        r"^(DATABANK +NAME=gpr(\d+) .*)$", lambda m: "" if int(m[2]) < taken else m[1], text, flags=re.MULTILINE
    )


def read_hex(file: Path) -> dict[int, int]:
    """Words of an Intel hex file by their address in the chip."""
    words: dict[int, int] = {}
    base = 0
    for line in file.read_text().splitlines():
        record = bytes.fromhex(line.strip()[1:])
        kind, data = record[3], record[4:-1]
        if kind == 4:
            base = int.from_bytes(data, "big") << 16
        elif kind == 0:
            start = base + int.from_bytes(record[1:3], "big")
            for i in range(0, len(data), 2):
                words[(start + i) // 2] = data[i] | data[i + 1] << 8
    return words


def ram_of(text: str) -> int:
    """Bytes of RAM in a map file of gplink: its sections of data outside the chip's registers."""
    sections = re.findall(r"^ *(\S+) +udata\S* +0x([0-9a-f]+) +data +0x([0-9a-f]+)", text, flags=re.MULTILINE)
    return sum(int(size, 16) for _, address, size in sections if int(address, 16) % 0x80 >= 0x20)

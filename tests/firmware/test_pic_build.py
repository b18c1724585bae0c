"""The hex files for the real chip: built from these sources, and what they are made of."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from tests.firmware.build import FIRMWARE

PIC = FIRMWARE / "pic"
PROGRAMS = ("board", "board_fast", "receiver")


@pytest.fixture(scope="module")
def programs() -> object:
    sys.path.insert(0, str(PIC))
    import programs as module

    return module


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", PROGRAMS)
def test_it_fits_the_chip(pic_hex: Path, programs: object, name: str) -> None:
    words = programs.read_hex(pic_hex / f"{name}.hex")
    flash = sum(address < programs.FLASH_WORDS for address in words)
    ram = programs.ram_of((pic_hex / f"{name}.map").read_text())
    print(f"{name}: {flash} of {programs.FLASH_WORDS} words, {ram} bytes of RAM besides linear memory")
    assert 1000 < flash < programs.FLASH_WORDS
    assert 100 < ram < programs.RAM_BYTES
    assert all(address < programs.FLASH_WORDS or 0x8007 <= address <= 0x800B for address in words)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", PROGRAMS)
def test_configuration_words_and_bank_selection(pic_hex: Path, programs: object, name: str) -> None:
    words = programs.read_hex(pic_hex / f"{name}.hex")
    watchdog_on, brown_out_on = 0x60, 0xC0
    assert words[0x8009] & watchdog_on == watchdog_on
    assert words[0x8008] & brown_out_on == brown_out_on
    assert words[0x8007] & 0x77 == 0x04  # no external oscillator, HFINTOSC at 32 MHz
    code = [word for address, word in words.items() if address < programs.FLASH_WORDS]
    assert sum(0x0140 <= word <= 0x017F for word in code) > 100  # MOVLB of this chip
    assert not any(0x0020 <= word <= 0x003F for word in code)  # MOVLB of the 16F1788, which gplink takes it for


SMALL = """
#include <stdint.h>
#include <string.h>
typedef struct { uint8_t gain; uint8_t table[3]; } settings;
typedef struct { const settings *config; uint8_t sum; } part;
typedef struct { part first; part second; uint8_t bytes[4]; uint8_t *cursor; uint8_t flags; } whole;
static const settings shared = {3, {[1] = 7}};
uint8_t result[8];
static inline void twice(uint8_t *value) { *value = (uint8_t)(*value * 2u); }
static void add(part *p, uint8_t value) { p->sum = (uint8_t)(p->sum + value * p->config->gain); }
static uint8_t flags(const whole *w) { return (uint8_t)(w->flags | 1u); }
static void fill(uint8_t bytes[4], uint8_t from)
{
    for (uint8_t i = 0; i < 4u; ++i) { bytes[i] = (uint8_t)(from + i); }
}
static void start(whole *w, const settings *config)
{
    memset(w, 0, sizeof *w);
    w->first.config = config;
    w->second.config = config;
    w->cursor = &w->bytes[1];
    w->flags = 4;
}
static void unreachable(whole *w) { w->flags = 0; }
static whole the_whole;
void program_run(void)
{
    start(&the_whole, &shared);
    add(&the_whole.first, 5);  /* two parts: this parameter stays */
    add(&the_whole.second, 6);
    fill(the_whole.bytes, 10);
    the_whole.cursor = &the_whole.bytes[2]; /* no constant */
    *the_whole.cursor = 99;
    twice(&the_whole.first.sum);
    result[0] = the_whole.first.sum;
    result[1] = the_whole.second.sum;
    memcpy(&result[2], the_whole.bytes, 4);
    result[6] = flags(&the_whole);
    result[7] = the_whole.first.config->table[1];
}
"""
MAIN = """
int printf(const char *format, ...);
int main(void) { program_run(); for (int i = 0; i < 8; ++i) printf("%d ", result[i]); return 0; }
"""


def compiled_result(source: Path, text: str) -> str:
    source.write_text(text)
    subprocess.run(
        ["cc", "-std=gnu99", "-w", "-fno-builtin", "-o", str(source.with_suffix("")), str(source)], check=True
    )
    return subprocess.run([source.with_suffix("")], capture_output=True, text=True, check=True).stdout


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.usefixtures("pic_hex")
def test_a_specialised_program_does_the_same(tmp_path: Path) -> None:
    """SMALL as it stands and after the pass, both by the host's compiler."""
    sys.path.insert(0, str(PIC))
    from toolchain import ensure

    sys.path.insert(0, str(ensure().python))
    from propagation import Program
    from specialise import specialise
    from units import Split, parse

    (tmp_path / "small.c").write_text(SMALL)
    command = ["cpp", "-P", "-nostdinc", f"-I{PIC / 'headers'}", str(tmp_path / "small.c")]
    unit = parse("small", subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    made = specialise(Program([unit], Split("the_whole", "whole"), "program_run"))
    expected = "30 18 10 11 99 13 5 7 "
    assert compiled_result(tmp_path / "before.c", SMALL + MAIN) == expected
    assert compiled_result(tmp_path / "after.c", made + MAIN) == expected
    assert "unreachable" not in made
    assert re.search(r"void small_add\(part \*p, uint8_t value\)", made)
    assert re.search(r"uint8_t small_flags\(void\)", made)
    assert "the_whole_flags | 1u" in made
    assert not re.search(r"\bthe_whole\b", made)


def test_locals_go_to_sections_of_their_functions() -> None:
    sys.path.insert(0, str(PIC))
    from frames import own_locals

    text = (
        "head\nUDL_x_0\tudata\nr0x10\tres\t1\nr0x11\tres\t2\n; code\nS_x__a\tcode\n\tMOVWF\tr0x10\n;\tr0x11\n"
        "S_x__b\tcode\n\tMOVF\tr0x10,W\n\tMOVWF\t(r0x11 + 1)\n"
    )
    made = own_locals(text).splitlines()
    assert made[1:6] == ["locals_0\tudata", "l0r0x10\tres\t1", "locals_1\tudata", "l1r0x10\tres\t1", "l1r0x11\tres\t2"]
    assert "\tMOVWF\tl0r0x10" in made
    assert "\tMOVWF\t(l1r0x11 + 1)" in made
    assert own_locals("no locals") == "no locals"


def test_banks_of_linear_memory_are_kept_from_the_linker(programs: object) -> None:
    script = (PIC / "pic16f15356.lkr").read_text()
    left = re.findall(r"NAME=gpr(\d+)", programs.linker_script(script, 1280))
    assert [int(bank) for bank in left] == list(range(16, 25))
    assert programs.linker_script(script, 0) == script


def test_without_network_the_command_says_skip_and_why(tmp_path: Path) -> None:
    environment = {"PATH": "/usr/bin:/bin", "GSENSE_CACHE": str(tmp_path / "cache"), "http_proxy": "http://127.0.0.1:9"}
    command = [sys.executable, str(PIC / "build.py"), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    last = done.stdout.strip().splitlines()[-1]
    assert last.startswith("SKIP: "), done.stdout
    assert len(last) > 20
    assert list((tmp_path / "cache" / "gsense").glob("pic-*/")) == []

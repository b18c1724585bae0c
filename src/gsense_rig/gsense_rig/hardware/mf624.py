"""Humusoft MF624 DAQ card: finding it. The register access is not written yet, and nothing here pretends it is."""

from __future__ import annotations

from pathlib import Path

from gsense_rig.hardware.interface import HardwareError

UIO_CLASS = Path("/sys/class/uio")
UIO_NAME = "mf624"  # what the kernel's uio_mf624 driver calls its device


def find_card(uio_class: Path = UIO_CLASS) -> Path | None:
    """Return the sysfs folder of the first MF624 that the kernel's UIO driver serves, or None."""
    for folder in sorted(uio_class.glob("uio*")):
        try:
            name = (folder / "name").read_text(encoding="ascii").strip()
        except (OSError, UnicodeDecodeError):
            continue
        if name == UIO_NAME:
            return folder
    return None


def open_card(uio_class: Path = UIO_CLASS) -> None:
    """Look for the card and say in one line why it cannot be used.

    Raises:
        HardwareError: always, for now: no card, or a card that this version cannot drive.
    """
    card = find_card(uio_class)
    if card is None:
        raise HardwareError(
            f"no MF624 card: no device named '{UIO_NAME}' under {uio_class} (load the kernel module uio_mf624, "
            "blacklist mf6x4), or use hardware:=sim"
        )
    raise HardwareError(f"found an MF624 card at {card}, but this version cannot drive it yet; use hardware:=sim")

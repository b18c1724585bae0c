"""The constant part of a frame's way: from the start of the sensor's read to its last byte in the host.

Times of board and receiver are those of the PIC16F15356 at 8 MIPS (bursts at 400 kHz I2C, packing, CRC, SPI at
2 MHz), as its emulator has them; the air time is one nRF24L01+ transmission at 2 Mbit/s without retry. What varies
(retries, USB, the host) is the clock model's matter.
"""

from __future__ import annotations

from gsense_driver.frames import TYPE_BNO_AMG, TYPE_BNO_NDOF, TYPE_MPU, TYPE_STATUS
from gsense_driver.stream import WIRE_SIZE

_READ_S = {TYPE_MPU: 534e-6, TYPE_BNO_AMG: 640e-6, TYPE_STATUS: 0.0, TYPE_BNO_NDOF: 700e-6}  # MPU: LISY300 included
_PACK_S = 319e-6  # fields, CRC, how the frame before went
_SPI_S = 190e-6  # 33 bytes into the transmitter
_RECEIVER_S = 860e-6  # from the end of the packet to the first serial byte: SPI, ring, COBS
_AIR_S = 130e-6 + 8 * (1 + 5 + 2 + 32 + 2) / 2e6  # settling; preamble, address, control, payload, CRC
_BITS_PER_BYTE = 10  # start, 8, stop


def transport_delay(baud: int) -> float:
    """Default of the parameter `transport_delay`: seconds for an MPU frame over a real radio and a line of `baud`."""
    return _READ_S[TYPE_MPU] + _PACK_S + _SPI_S + _AIR_S + _RECEIVER_S + WIRE_SIZE * _BITS_PER_BYTE / baud


def delays_by_type(mpu_delay: float) -> dict[int, float]:
    """Delay of each frame type in seconds, given that of an MPU frame; they differ by the length of the read.

    A delay of zero (a pseudo-terminal, where nothing is clocked out) stays zero for all.
    """
    if mpu_delay <= 0.0:
        return dict.fromkeys(_READ_S, 0.0)
    return {frame_type: max(0.0, mpu_delay + (read - _READ_S[TYPE_MPU])) for frame_type, read in _READ_S.items()}

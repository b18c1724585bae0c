"""The radio's 32-byte frame: layout, check and typed bodies.

Pure functions over bytes; nothing here raises on data from the wire. Frames are little-endian, except the MPU-6050's
registers, which are copied as the chip holds them (big-endian). Layout: the interface document, section 5.
"""

from __future__ import annotations

from binascii import crc_hqx
from struct import Struct
from typing import NamedTuple

PAYLOAD_SIZE = 32
VERSION = 1

TYPE_MPU = 1
TYPE_BNO_AMG = 2
TYPE_STATUS = 3
TYPE_BNO_NDOF = 4

FLAG_READ_FAILED = 0x01
FLAG_STARTED = 0x02
FLAG_BATTERY_LOW = 0x04

# offset 0 version|type, 1 flags, 2 sequence, 4 board time us, 8 body, 30 CRC-16/CCITT-FALSE over bytes 0..29
_PAYLOAD = Struct("<BBHI22sH")
_MPU_REGISTERS = Struct(">7h")  # 0x3B..0x48: ax ay az temperature gx gy gz
_MPU_REST = Struct("<HHBBBB")  # LISY300 sum, battery mV, frames given up, I2C errors, retransmissions, zero
_BNO_AMG = Struct("<9hBbH")  # 0x08..0x19: acc mag gyr; CALIB_STAT, temperature, age of the sample in us
_STATUS = Struct("<12BHHIH")
_BNO_NDOF = Struct(
    "<10hBb"
)  # 0x1A..0x2D: Euler h r p, quaternion w x y z, linear acceleration; CALIB_STAT, temperature

# The same fields as plain tuples, for the hot path: naming them costs more than unpacking them.
mpu_registers = _MPU_REGISTERS.unpack_from  # of a type 1 body; `MpuBody` up to gz
mpu_rest = _MPU_REST.unpack_from  # of a type 1 body from offset 14; `MpuBody` from lisy_sum
bno_amg_fields = _BNO_AMG.unpack  # `BnoAmgBody`

assert _PAYLOAD.size == PAYLOAD_SIZE  # noqa: S101 - the layout itself, checked at import
assert _MPU_REGISTERS.size + _MPU_REST.size == _BNO_AMG.size == _STATUS.size == _BNO_NDOF.size == 22  # noqa: S101


class Frame(NamedTuple):
    """A frame whose CRC and version are right."""

    type: int
    flags: int
    sequence: int  # u16, one counter over all types
    time_us: int  # u32 board time at the start of the sensor's read
    body: bytes  # 22 bytes


class MpuBody(NamedTuple):
    """Type 1: MPU-6050 registers 0x3B..0x48 as int16 counts, and what travels with them."""

    ax: int
    ay: int
    az: int
    temperature: int
    gx: int
    gy: int
    gz: int
    lisy_sum: int  # sum of 16 conversions of 10 bits
    battery_mv: int
    radio_given_up: int  # u8, wraps
    i2c_errors: int  # u8, wraps
    retransmissions: int  # of the last frame
    reserved: int


class BnoAmgBody(NamedTuple):
    """Type 2: BNO055 registers 0x08..0x19 as int16 counts (accelerometer, magnetometer, gyro)."""

    ax: int
    ay: int
    az: int
    mx: int
    my: int
    mz: int
    gx: int
    gy: int
    gz: int
    calib_stat: int
    temperature: int  # degrees Celsius
    age_us: int


class StatusBody(NamedTuple):
    """Type 3, once a second: what the board has configured."""

    firmware_major: int
    firmware_minor: int
    mpu_dlpf_cfg: int
    mpu_fs_afs: int  # FS_SEL << 4 | AFS_SEL
    mpu_smplrt_div: int
    bno_opr_mode: int
    bno_acc_config: int
    bno_gyr_config_0: int
    bno_gyr_config_1: int
    bno_mag_config: int
    reset_cause: int
    bno_unit_sel: int
    mpu_period_us: int
    bno_period_us: int
    uptime_s: int
    reserved: int


class BnoNdofBody(NamedTuple):
    """Type 4: BNO055 registers 0x1A..0x2D as int16 counts (the chip's own fusion)."""

    heading: int
    roll: int
    pitch: int
    qw: int
    qx: int
    qy: int
    qz: int
    lx: int
    ly: int
    lz: int
    calib_stat: int
    temperature: int  # degrees Celsius


def parse_payload(payload: bytes) -> Frame | str:
    """Check a 32-byte payload; a `Frame`, or the reason of its rejection: "length", "crc" or "version"."""
    if len(payload) != PAYLOAD_SIZE:
        return "length"
    version_type, flags, sequence, time_us, body, crc = _PAYLOAD.unpack(payload)
    if crc_hqx(payload[:30], 0xFFFF) != crc:
        return "crc"
    if version_type >> 5 != VERSION:
        return "version"
    return Frame(version_type & 0x1F, flags, sequence, time_us, body)


def decode_mpu(body: bytes) -> MpuBody:
    """Body of a type 1 frame."""
    return MpuBody._make(_MPU_REGISTERS.unpack_from(body) + _MPU_REST.unpack_from(body, 14))


def decode_bno_amg(body: bytes) -> BnoAmgBody:
    """Body of a type 2 frame."""
    return BnoAmgBody._make(_BNO_AMG.unpack(body))


def decode_status(body: bytes) -> StatusBody:
    """Body of a type 3 frame."""
    return StatusBody._make(_STATUS.unpack(body))


def decode_bno_ndof(body: bytes) -> BnoNdofBody:
    """Body of a type 4 frame."""
    return BnoNdofBody._make(_BNO_NDOF.unpack(body))

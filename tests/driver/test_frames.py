import json
from pathlib import Path

import pytest
from tests.driver import wire

from gsense_driver import frames
from gsense_driver.stream import FrameStream

GOLDEN = json.loads((Path(__file__).parents[2] / "firmware/tests/golden_frames.json").read_text())["frames"]


def decoded(frame: frames.Frame) -> dict:
    if frame.type == frames.TYPE_MPU:
        b = frames.decode_mpu(frame.body)
        names = ("temperature", "lisy_sum", "battery_mv", "radio_given_up", "i2c_errors", "retransmissions")
        out = {name: getattr(b, name) for name in names}
        return {**out, "acc": [b.ax, b.ay, b.az], "gyr": [b.gx, b.gy, b.gz]}
    if frame.type == frames.TYPE_BNO_AMG:
        b = frames.decode_bno_amg(frame.body)
        out = {name: getattr(b, name) for name in ("calib_stat", "temperature", "age_us")}
        return {**out, "acc": [b.ax, b.ay, b.az], "mag": [b.mx, b.my, b.mz], "gyr": [b.gx, b.gy, b.gz]}
    if frame.type == frames.TYPE_BNO_NDOF:
        b = frames.decode_bno_ndof(frame.body)
        return {
            "euler": [b.heading, b.roll, b.pitch],
            "quaternion": [b.qw, b.qx, b.qy, b.qz],
            "linear_acceleration": [b.lx, b.ly, b.lz],
            "calib_stat": b.calib_stat,
            "temperature": b.temperature,
        }
    return frames.decode_status(frame.body)._asdict()


def test_golden_frames_cover_every_type():
    assert {golden["type"] for golden in GOLDEN} == {1, 2, 3, 4}


@pytest.mark.parametrize("golden", GOLDEN, ids=lambda golden: golden["name"])
def test_golden_frame_decodes_to_its_fields(golden):
    frame = frames.parse_payload(bytes.fromhex(golden["hex"]))
    assert isinstance(frame, frames.Frame)
    for name in ("type", "flags", "sequence", "time_us"):
        assert getattr(frame, name) == golden[name]
    fields, got = dict(golden["fields"]), decoded(frame)
    if frame.type == frames.TYPE_STATUS:
        status = frames.decode_status(frame.body)
        fs, afs = fields.pop("mpu_fs_sel"), fields.pop("mpu_afs_sel")
        assert status.mpu_fs_afs == fs << 4 | afs
        rename = {"major": "firmware_major", "minor": "firmware_minor"}
        fields = {rename.get(key, key): value for key, value in fields.items()}
    assert {key: got[key] for key in fields} == fields


@pytest.mark.parametrize("golden", GOLDEN, ids=lambda golden: golden["name"])
def test_golden_packet_passes_the_stream(golden):
    stream = FrameStream()
    assert stream.feed(bytes.fromhex(golden["packet"])) == [frames.parse_payload(bytes.fromhex(golden["hex"]))]


def test_own_encoder_agrees_with_the_decoder():
    frame = frames.parse_payload(wire.payload(1, 7, 123456, wire.mpu_body(acc=(1, -2, 3), gyr=(-4, 5, -6), lisy=9)))
    assert isinstance(frame, frames.Frame)
    assert frames.decode_mpu(frame.body)[:8] == (1, -2, 3, 0, -4, 5, -6, 9)


def test_wrong_crc_version_and_length_are_named():
    good = wire.payload(1, 7, 1, wire.mpu_body())
    assert frames.parse_payload(good[:-1]) == "length"
    assert frames.parse_payload(wire.payload(1, 7, 1, wire.mpu_body(), version=2)) == "version"
    for i in range(32):
        for bit in range(8):
            broken = bytearray(good)
            broken[i] ^= 1 << bit
            assert frames.parse_payload(bytes(broken)) == "crc"

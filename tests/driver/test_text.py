import pytest
from hypothesis import given
from hypothesis import strategies as st

from gsense_driver.errors import SettingError
from gsense_driver.pipeline import Pipeline, PipelineSettings
from gsense_driver.samples import ImuReading
from gsense_driver.stream import Reject
from gsense_driver.text import DEFAULT_COLUMNS, Row, TextStream, parse_columns

COLUMNS = ("mpu6050.ax", "mpu6050.ay", "mpu6050.az", "-", "lisy300.z")


def stream() -> TextStream:
    out = TextStream(COLUMNS, 16)
    out.feed(b"rest of a line\r\n")
    return out


def test_lines_become_rows():
    assert stream().feed(b"7;1;-2;3;99;512\r\n8;1;2;3;4;5;\r\n") == [
        Row(7, (1, -2, 3, 99, 512)),
        Row(8, (1, 2, 3, 4, 5)),
    ]


@pytest.mark.parametrize("line", [b"7;1;2;3;4", b"7;1;2;3;4;5;6", b"7;1;x;3;4;5", b"-1;1;2;3;4;5", b"70000;1;2;3;4;5"])
def test_broken_lines_are_rejected(line):
    assert [type(item) for item in stream().feed(line + b"\r\n7;1;2;3;4;5\r\n")] == [Reject, Row]


@given(st.lists(st.binary(max_size=700), max_size=10))
def test_any_bytes_are_survived_with_bounded_memory(chunks):
    s = stream()
    for chunk in chunks:
        s.feed(chunk)
        assert len(s._pending) <= 512


def test_columns_are_checked():
    assert parse_columns(DEFAULT_COLUMNS) == DEFAULT_COLUMNS
    for bad in (["mpu6050.ax", "gyro"], ["mpu6050.ax", "mpu6050.ax"], ["-"], []):
        with pytest.raises(SettingError, match=r"text\.columns"):
            parse_columns(bad)


def test_a_pipeline_of_text_finds_the_true_period_and_counts_losses_over_the_wrap():
    """The thesis's loop takes 40 ms nominally, here 40.6 ms; the counter has 8 bits."""
    settings = PipelineSettings(protocol="text", text_columns=COLUMNS, text_counter_bits=8)
    pipeline = Pipeline(settings)
    pipeline.feed(b"\n", 0)
    stamps, true = [], []
    for i in range(1500):
        if i % 100 == 50:
            continue
        arrival = round((i * 0.0406 + (0.005 if i % 7 else 0.0005)) * 1e9)
        readings = pipeline.feed(b"%d;0;0;8192;1;512\r\n" % (i % 256), arrival)
        imu = [r for r in readings if isinstance(r, ImuReading) and r.sensor == "mpu6050"]
        if imu and i > 750:
            assert imu[0].rate is None
            assert imu[0].force == pytest.approx((0, 0, 9.80665))
            stamps.append(imu[-1].stamp_ns * 1e-9)
            true.append(i * 0.0406)
    assert pipeline.link.counts.lost == 15
    assert pipeline.link.counts.restarts == 0
    errors = [s - t for s, t in zip(stamps, true, strict=True)]
    assert max(errors) - min(errors) < 4e-3

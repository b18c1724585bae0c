import io
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from tests.driver import wire
from tests.driver.test_settings import values

from gsense_driver import raw_log_writer
from gsense_driver.errors import RawLogError, SettingError
from gsense_driver.raw_log import MAGIC, Kind, RawLogHeader, encode_header, encode_record, read_header, read_records
from gsense_driver.raw_log_writer import RawLogWriter
from gsense_driver.session import Session, header_of
from gsense_driver.settings import make_settings

HEADER = RawLogHeader("/dev/ttyUSB0", 460800, "binary", "u1", 17, {"baud": 460800, "bno055.gyro_lsb_per_dps": 16.1})


def read(path):
    with path.open("rb") as stream:
        return read_header(stream, str(path)), list(read_records(stream, str(path)))


def test_what_was_put_is_read_back(tmp_path):
    writer = RawLogWriter(str(tmp_path / "a.raw"), HEADER)
    pieces = [bytes([i % 256]) * (i % 50) for i in range(1000)]
    for i, piece in enumerate(pieces):
        writer.put(Kind.DATA, i * 10, piece)
    writer.put(Kind.OPENED, 99)
    writer.close()
    writer.close()
    header, records = read(tmp_path / "a.raw")
    assert header == HEADER
    assert [record.payload for record in records[:1000]] == pieces
    assert [record.time_ns for record in records[:1001]] == [*range(0, 10000, 10), 99]
    assert [record.kind for record in records[-2:]] == [Kind.OPENED, Kind.END]
    assert writer.written == (tmp_path / "a.raw").stat().st_size


def test_an_existing_file_is_kept(tmp_path):
    (tmp_path / "a.raw").write_bytes(b"precious")
    for name in ("a-2.raw", "a-3.raw"):
        writer = RawLogWriter(str(tmp_path / "a.raw"), HEADER)
        writer.close()
        assert writer.path == tmp_path / name
    assert (tmp_path / "a.raw").read_bytes() == b"precious"
    with pytest.raises(SettingError, match=r"raw_log: cannot create .*/no/a\.raw"):
        RawLogWriter(str(tmp_path / "no" / "a.raw"), HEADER)


def test_a_log_cut_off_anywhere_gives_its_whole_records(tmp_path):
    whole = encode_header(HEADER) + b"".join(encode_record(Kind.DATA, i, bytes(i)) for i in range(5))
    start = len(encode_header(HEADER))
    ends = [start + sum(16 + k for k in range(i + 1)) for i in range(5)]
    for size in range(start, len(whole) + 1):
        path = tmp_path / "cut"
        path.write_bytes(whole[:size])
        assert len(read(path)[1]) == sum(end <= size for end in ends)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is no raw log"),
        (b"\x00" * 100, "is no raw log"),
        (MAGIC + b"\xff\xff\xff\xff", "header is damaged"),
        (MAGIC + b"\x02\x00\x00\x00[]", "header is damaged"),
        (MAGIC + b"\x02\x00\x00\x00{}", "header is damaged"),
        (encode_header(HEADER) + b"\xee" * 40, "damaged at byte"),
    ],
)
def test_what_is_no_log_is_said_with_its_name(content, words):
    def read_all():
        stream = io.BytesIO(content)
        return read_header(stream, "some.raw"), list(read_records(stream, "some.raw"))

    with pytest.raises(RawLogError, match=words) as caught:
        read_all()
    assert str(caught.value).startswith("some.raw: ")
    assert "\n" not in str(caught.value)


class Disk(io.FileIO):
    """Stands still until it is let go."""

    free = threading.Event()

    def write(self, data):
        assert self.free.wait(60.0)
        return super().write(data)


def wait_until(condition, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "timed out"
        time.sleep(0.02)


def test_a_disk_too_slow_costs_records_that_are_counted_and_told(tmp_path, monkeypatch):
    monkeypatch.setattr(raw_log_writer, "_create", lambda path: (path, Disk(path, "xb")))
    Disk.free.clear()
    writer = RawLogWriter(str(tmp_path / "a.raw"), HEADER, limit_bytes=1000)
    for i in range(100):
        writer.put(Kind.DATA, i, bytes(100))  # nobody waits for the disk, or this would never end
    Disk.free.set()
    wait_until(lambda: writer._queued == 0)
    writer.put(Kind.DATA, 500, b"after")
    writer.close()
    _, records = read(tmp_path / "a.raw")
    (lost,) = [record for record in records if record.kind is Kind.LOST]
    count = int.from_bytes(lost.payload[:8], "little")
    assert count == writer.lost_records > 50
    assert count + sum(record.kind is Kind.DATA for record in records) == 101
    assert writer.lost_bytes == 100 * count


def test_a_full_disk_ends_the_log_and_not_the_driver(monkeypatch):
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    monkeypatch.setattr(raw_log_writer, "_create", lambda path: (path, io.FileIO("/dev/full", "wb")))
    writer = RawLogWriter("/dev/full", HEADER)
    wait_until(lambda: writer.problem is not None)
    writer.put(Kind.DATA, 1, b"x")
    writer.close()
    assert "No space left" in writer.problem
    assert writer.lost_records >= 1


def test_a_killed_writer_leaves_what_it_wrote(tmp_path):
    path = tmp_path / "a.raw"
    code = (
        "import sys, time\n"
        "from gsense_driver.raw_log import Kind, RawLogHeader\n"
        "from gsense_driver.raw_log_writer import RawLogWriter\n"
        f"writer = RawLogWriter({str(path)!r}, RawLogHeader('p', 1, 'binary', '', 0, {{}}))\n"
        "for i in range(100): writer.put(Kind.DATA, i, bytes(34))\n"
        "print('put', flush=True); time.sleep(100)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, env=environment)
    assert process.stdout.readline() == b"put\n"
    wait_until(lambda: path.stat().st_size > 0 and len(read(path)[1]) == 100)
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    assert len(read(path)[1]) == 100


class Notes:
    """An outlet that notes everything."""

    def __init__(self):
        self.lines = []

    def configure(self, settings, scales):
        self.lines.append(("configure", settings.sensors, settings.unit_id, scales))

    def publish(self, reading):
        self.lines.append(reading)

    def publish_link(self, *arguments):
        self.lines.append(repr(arguments))

    def publish_health(self, *arguments):
        self.lines.append(repr(arguments))


def test_a_replay_makes_the_same_calls_with_the_same_results(tmp_path):
    pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")
    from gsense_driver.replay import apply, make_session

    settings = make_settings(values(unit_id="unit-7", transport_delay=0.0021))
    header = header_of(settings, 1_700_000_000_123_456_789)
    log = RawLogWriter(str(tmp_path / "a.raw"), header)
    live = Notes()
    session = Session(settings, header.wall_offset_ns, live, "bench/bridge", log)
    session.opened(0)
    session.opened(1)
    frames = [*wire.Board(start_us=2**32 - 1_500_000).frames(3.0), *wire.Board().frames(2.0, begin=3.5)]
    for i, (when, data) in enumerate(frames):
        now_ns = round(when * 1e9) + i * 7919 % 3_000_000
        packet = wire.cobs(data)
        session.feed(packet[:10] + b"\x05" * (i % 97 == 5), now_ns)
        session.feed(packet[10:] + packet * (i % 101 == 7), now_ns + 1000)
        if i % 300 == 299:
            session.report(now_ns + 2000, now_ns + header.wall_offset_ns, "gone" if i > 600 else None)
        if i == 400:
            session.set_wall_offset(header.wall_offset_ns + 5_000_000, now_ns)
        if i == 500:
            session.configure(make_settings({**settings.values, "mpu6050.mounting": "-y x z"}), now_ns)
        if i == 700:
            session.opened(now_ns)
    log.close()
    header_read, records = read(tmp_path / "a.raw")
    again = Notes()
    copy = make_session(header_read, again, "bench/bridge")
    for record in records:
        apply(copy, record)
    assert len(live.lines) > 2000
    assert again.lines == live.lines
    assert copy.pipeline.link.counts == session.pipeline.link.counts
    assert copy.pipeline.link.counts.restarts == 1
    assert copy.pipeline.link.counts.corrupt > 0

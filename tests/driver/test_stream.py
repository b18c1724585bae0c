import random

from hypothesis import given, settings
from hypothesis import strategies as st
from tests.driver import wire

from gsense_driver.frames import Frame
from gsense_driver.pipeline import Pipeline, PipelineSettings
from gsense_driver.stream import FrameStream, Reject

PACKETS = [wire.cobs(wire.payload(1 + i % 2, i, 5000 * i, bytes(range(i, i + 22)))) for i in range(40)]
STREAM = b"".join(PACKETS)


def chunked(data: bytes, sizes: list[int]) -> list[bytes]:
    chunks, at, k = [], 0, 0
    while at < len(data):
        size = sizes[k % len(sizes)]
        chunks.append(data[at : at + size])
        at, k = at + size, k + 1
    return chunks


def feed(stream: FrameStream, chunks: list[bytes]) -> list[Frame | Reject]:
    return [item for chunk in chunks for item in stream.feed(chunk)]


@given(st.lists(st.integers(1, 90), min_size=1, max_size=8))
def test_any_chunking_gives_the_same_frames(sizes):
    items = feed(FrameStream(), chunked(STREAM, sizes))
    assert [item.sequence for item in items if isinstance(item, Frame)] == list(range(40))
    assert len(items) == 40


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=2000), st.integers(1, 300))
def test_random_bytes_never_raise_and_never_give_a_frame_with_a_wrong_crc(data, size):
    items = feed(FrameStream(), chunked(data, [size]))
    for item in items:
        if isinstance(item, Frame):  # possible once in 65536 packets of the right length: then its CRC is right
            assert wire.payload(item.type, item.sequence, item.time_us, item.body, item.flags)


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 12))
def test_mutated_streams_give_only_frames_that_were_sent(seed, mutations):
    rng = random.Random(seed)
    data = bytearray(STREAM)
    for _ in range(mutations):
        at = rng.randrange(len(data))
        action = rng.randrange(3)
        if action == 0:
            data[at] ^= 1 << rng.randrange(8)
        elif action == 1:
            del data[at]
        else:
            data.insert(at, rng.randrange(256))
    sent = set(feed(FrameStream(), [STREAM]))
    pipeline = Pipeline(PipelineSettings())
    got = [item for item in FrameStream().feed(bytes(data)) if isinstance(item, Frame)]
    assert set(got) <= sent
    assert len(got) >= 40 - 2 * mutations
    for k, chunk in enumerate(chunked(bytes(data), [50])):
        pipeline.feed(chunk, k * 1_000_000)
    assert pipeline.link.counts.received == len(set(got))


def test_memory_is_bounded_without_delimiters_and_the_stream_recovers():
    stream = FrameStream()
    rejected = sum(item.size for _ in range(200) for item in stream.feed(b"\x55" * 100))
    assert rejected > 19_000
    assert len(stream._pending) < 200
    assert [type(item) for item in stream.feed(b"\0" + PACKETS[3])][-1] is Frame


def test_rejects_name_their_reason_and_every_byte_is_accounted_for():
    stream = FrameStream()
    broken = bytearray(wire.payload(1, 1, 1, bytes(22)))
    broken[12] ^= 4
    data = PACKETS[0] + wire.cobs(bytes(broken)) + b"\x01\x02\0" + PACKETS[1]
    items = stream.feed(data)
    assert [item.reason if isinstance(item, Reject) else "frame" for item in items] == [
        "frame",
        "crc",
        "length",
        "frame",
    ]
    assert stream.rejected_bytes == 34 + 3
    assert stream.bytes_in == len(data)


def test_joining_in_the_middle_of_a_packet_is_no_error():
    stream = FrameStream()
    items = stream.feed(PACKETS[0][10:] + PACKETS[1])
    assert [item.sequence for item in items if isinstance(item, Frame)] == [1]
    assert len(items) == 1
    assert stream.skipped_bytes == 24

import random

import pytest
from tests.driver import wire

from gsense_driver.link import LinkCounts
from gsense_driver.pipeline import Pipeline, PipelineSettings


def run(pipeline: Pipeline, events: list[tuple[float, bytes]]) -> LinkCounts:
    for t, data in events:
        pipeline.feed(data, round((t + 0.002) * 1e9))
    return pipeline.link.counts


def packets(frames: list[tuple[float, bytes]]) -> list[tuple[float, bytes]]:
    return [(t, wire.cobs(data)) for t, data in frames]


def flipped(data: bytes, rng: random.Random) -> bytes:
    """One bit of the payload turned over: a sound packet around a broken frame."""
    out = bytearray(data)
    out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


@pytest.mark.parametrize("seed", range(5))
def test_counts_equal_what_was_injected(seed):
    rng = random.Random(seed)
    truth = LinkCounts()
    events = []
    frames = wire.Board().frames(12.0)
    for i, (t, data) in enumerate(frames):
        fate = rng.random() if 0 < i < len(frames) - 1 else 1.0
        if fate < 0.02:
            truth.lost += 1
            continue
        if fate < 0.03:
            truth.corrupt += 1
            events.append((t, wire.cobs(flipped(data, rng))))
            continue
        truth.received += 1
        events.append((t, wire.cobs(data)))
        if fate < 0.04:
            truth.duplicate += 1
            events.append((t + 1e-4, wire.cobs(data)))
    assert truth.lost > 30
    assert truth.corrupt > 10
    assert run(Pipeline(PipelineSettings()), events) == truth


def test_a_bit_flip_on_the_wire_counts_as_one_corrupt_frame_even_where_it_makes_a_delimiter():
    frames = packets(wire.Board().frames(0.5))
    t, data = frames[20]
    for i in range(33):
        broken = bytearray(data)
        broken[i] = 0
        events = [*frames[:20], (t, bytes(broken)), *frames[21:]]
        counts = run(Pipeline(PipelineSettings()), events)
        assert (counts.lost, counts.corrupt, counts.received) == (0, 1, len(frames) - 1)


def test_reordered_frames_are_counted_and_not_lost():
    frames = packets(wire.Board().frames(2.0))
    for i in (50, 100, 300):
        frames[i], frames[i + 1] = (frames[i][0], frames[i + 1][1]), (frames[i + 1][0], frames[i][1])
    counts = run(Pipeline(PipelineSettings()), frames)
    assert (counts.reordered, counts.lost, counts.duplicate, counts.received) == (3, 0, 0, len(frames))


@pytest.mark.parametrize("ran", [0.45, 3.0, 40.0, 2400.0])
def test_restart_of_the_board_is_counted_once_and_nothing_is_lost(ran):
    """Also a board that had run for 40 min, whose fall back looks like an advance of half an hour."""
    old = wire.Board(start_us=round((ran - 2.0) * 1e6)) if ran > 3.0 else wire.Board()
    length = 2.0 if ran > 3.0 else ran
    frames = packets(old.frames(length)) + packets(wire.Board().frames(3.0, begin=length + 0.4))
    counts = run(Pipeline(PipelineSettings()), frames)
    assert (counts.restarts, counts.lost, counts.duplicate) == (1, 0, 0)


def test_restart_whose_first_seconds_were_not_heard_is_found():
    frames = packets(wire.Board().frames(5.0)) + packets(wire.Board().frames(12.0, begin=20.0))[2408:]
    counts = run(Pipeline(PipelineSettings()), frames)
    assert counts.restarts == 1


def test_both_wraps_pass_unnoticed():
    board = wire.Board(start_us=2**32 - 100_000_000)
    counts = run(Pipeline(PipelineSettings()), packets(board.frames(230.0)))  # 69230 frames: beyond 16 bits
    assert counts.received == 69230
    assert (counts.lost, counts.restarts, counts.duplicate) == (0, 0, 0)


def test_a_silence_longer_than_the_sequence_counts_all_its_frames():
    frames = packets(wire.Board(start_us=1).frames(260.0))
    kept = frames[:3000] + frames[3000 + 70000 :]
    counts = run(Pipeline(PipelineSettings()), kept)
    assert (counts.lost, counts.restarts) == (70000, 0)


def test_a_host_that_stalls_and_catches_up_sees_no_restart():
    pipeline = Pipeline(PipelineSettings())
    frames = packets(wire.Board().frames(30.0))
    events = [(max(t, 15.0) if 10.0 < t < 15.0 else t, data) for t, data in frames]
    counts = run(pipeline, events)
    assert (counts.restarts, counts.lost, pipeline.clock.steps) == (0, 0, 0)


@pytest.mark.parametrize("start_us", [0, 700_000, 2**32 - 500_000])
def test_reads_that_cross_are_neither_restarts_nor_reordered(start_us):
    """At 500 + 100 Hz a BNO read begins before an MPU's and is sent after it: the sequence rises, the time falls."""
    frames = []
    for i in range(3000):
        t = i * 2000
        frames.append((t, 1, wire.mpu_body()))
        if i % 5 == 2:
            frames.append((t - 700, 2, wire.bno_body(gyr=(i % 9, i % 7, 0))))
    events = [
        (t * 1e-6 + 0.001, wire.cobs(wire.payload(kind, i, start_us + t, body)))
        for i, (t, kind, body) in enumerate(frames)
    ]
    pipeline = Pipeline(PipelineSettings())
    counts = run(pipeline, events)
    assert counts == LinkCounts(received=len(frames))
    assert pipeline.clock.steps == 0

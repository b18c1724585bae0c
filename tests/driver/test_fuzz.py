import random

from hypothesis import given, settings
from hypothesis import strategies as st
from tests.driver.fuzzing import check, real_stream

from gsense_driver.link import LinkTracker
from gsense_driver.pipeline import Pipeline, PipelineSettings

REAL = real_stream(2.0)
EDITS = st.lists(st.tuples(st.integers(0, len(REAL) - 1), st.integers(0, 4), st.integers(0, 255)), max_size=30)


def mutated(edits):
    data = bytearray(REAL)
    for place, kind, value in edits:
        at = place % max(1, len(data))
        if kind == 0:
            data[at : at + 1] = bytes([value])
        elif kind == 1:
            del data[at : at + value]
        elif kind == 2:
            data[at:at] = bytes(random.Random(value).randbytes(value))
        elif kind == 3:
            data[at:at] = data[at : at + 4 * value]
        else:
            data[at : at + 1] = b"\0"
    return bytes(data)


@settings(max_examples=60, deadline=None)
@given(EDITS, st.integers(1, 3000))
def test_mutated_streams_give_exactly_the_frames_that_are_whole(edits, size):
    check(mutated(edits), size)


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=3000), st.integers(1, 300))
def test_random_bytes_have_one_place_each(data, size):
    check(data, size)


@settings(max_examples=30, deadline=None)
@given(EDITS, st.integers(20, 3000), st.sampled_from(["binary", "text"]))
def test_the_pipeline_never_raises_and_the_short_way_of_the_link_comes_to_the_same(edits, size, protocol):
    data = mutated(edits)
    outcomes = []
    for plain in (LinkTracker._is_next, lambda *_: False):
        pipeline = Pipeline(PipelineSettings(protocol=protocol))
        pipeline.link._is_next = plain.__get__(pipeline.link)
        readings = []
        for at in range(0, len(data), size):
            readings += pipeline.feed(data[at : at + size], at * 100_000)
        outcomes.append((readings, pipeline.link.counts))
    assert outcomes[0] == outcomes[1]

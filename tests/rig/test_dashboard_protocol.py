"""What pages may say and do: messages, the token, silence."""

from __future__ import annotations

import contextlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gsense_rig.dashboard.access import Access
from gsense_rig.dashboard.pages import LONGEST_TICK, MAX_AHEAD, MAX_PAGES, Pages
from gsense_rig.dashboard.protocol import Alive, Call, Hello, Move, ProtocolError, Sine, View, id_of, parse

SINE = {"type": "sinusoid", "id": 3, "amplitude": 0.15, "angular_frequency": 6, "cycles": 5}
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=5,
)
FIELDS = ("id", "n", "token", "sensor", "filter", "amplitude", "angular_frequency", "cycles", "shape", "position")
TYPES = ("hello", "alive", "view", "home", "stop", "sinusoid", "move")


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ({"type": "hello", "token": "abc"}, Hello("abc")),
        ({"type": "alive", "n": 7}, Alive(7)),
        ({"type": "view", "sensor": "mpu6050"}, View("mpu6050", "")),
        ({"type": "stop", "id": 1}, Call(1, "stop")),
        (SINE, Sine(3, 0.15, 6.0, 5)),
        ({"type": "move", "id": 1, "shape": "hold", "position": -0.1}, Move(1, 0, -0.1, 0.0, 0.0, 0.0)),
        ({"type": "move", "id": 1, "shape": "triangle", "amplitude": 0.1}, Move(1, 2, 0.0, 0.1, 0.0, 0.0)),
    ],
)
def test_messages(data, expected):
    assert parse(json.dumps(data)) == expected


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "not JSON"),
        ("[1]", "not a JSON object"),
        ("[" * 100_000, "not JSON"),
        (b"\x00", "binary"),
        ('{"type": "tune", "id": 1}', "type is unknown; use one of hello"),
        ('{"type": ["stop"]}', "type is unknown"),
        ('{"type": "stop"}', "id is not a whole number"),
        ('{"type": "stop", "id": true}', "id is not a whole number"),
        (json.dumps({**SINE, "amplitude": "0.1"}), "amplitude is not a number"),
        (json.dumps({**SINE, "amplitude": True}), "amplitude is not a number"),
        (json.dumps({**SINE, "amplitude": 10**400}), "amplitude is not a finite number"),
        (json.dumps({**SINE, "amplitude": float("nan")}), "not JSON"),
        (json.dumps({**SINE, "cycles": 1.5}), "cycles is not a whole number"),
        (json.dumps({**SINE, "cycles": -1}), "cycles is not a whole number"),
        ('{"type": "move", "id": 1, "shape": 1}', "shape is unknown; use one of hold, step, triangle"),
        (json.dumps({"type": "hello", "token": "x" * 300}), "token is not a text"),
    ],
)
def test_what_is_not_understood_is_said_in_a_line(text, complaint):
    with pytest.raises(ProtocolError) as caught:
        parse(text)
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


@given(st.sampled_from(TYPES), st.dictionaries(st.sampled_from(FIELDS), JSON))
def test_no_message_raises_anything_else(kind, fields):
    text = json.dumps({"type": kind, **fields})
    id_of(text)
    with contextlib.suppress(ProtocolError):
        parse(text)


@given(st.text() | st.binary())
def test_no_text_raises_anything_else(text):
    id_of(text)
    with contextlib.suppress(ProtocolError):
        parse(text)


def test_id_of_what_is_not_understood():
    assert id_of('{"id": 5, "type": "no"}') == 5
    assert id_of('{"id": "5"}') is None
    assert id_of("[5]") is None
    assert id_of("no") is None


def test_names_of_a_local_server():
    access = Access("127.0.0.1", frozenset({"rig-pc"}))
    for host in ("127.0.0.1:8077", "localhost:8077", "[::1]:8077", "LOCALHOST", "rig-pc:8077"):
        assert access.host_allowed(host), host
    for host in ("evil.example:8077", "192.168.1.5:8077", "127.0.0.1.evil.example", "", "[", "localhost@evil.example"):
        assert not access.host_allowed(host), host


def test_names_of_a_server_on_the_network():
    access = Access("0.0.0.0")
    assert access.host_allowed("192.168.1.5:8077")
    assert not access.host_allowed("evil.example:8077")


def test_origins():
    access = Access("127.0.0.1")
    assert access.origin_allowed("http://127.0.0.1:8077", "127.0.0.1:8077")
    for origin in (
        "http://evil.example",
        "https://127.0.0.1:8077",
        "http://127.0.0.1:9999",
        "http://localhost:8077",
        "null",
        "",
        "file://",
        "http://[",
    ):
        assert not access.origin_allowed(origin, "127.0.0.1:8077"), origin
    assert not access.origin_allowed("http://evil.example:8077", "evil.example:8077")


def test_token():
    access = Access("127.0.0.1")
    assert access.may_command(access.token)
    for wrong in ("", "x", access.token + "x", "é"):
        assert not access.may_command(wrong)
    assert Access("127.0.0.1").token != access.token
    assert access.address(8077) == f"http://127.0.0.1:8077/#token={access.token}"
    assert access.token not in repr(access)
    assert access.warning() is None
    assert "network" in (Access("0.0.0.0").warning() or "")
    assert Access("::1").address(1).startswith("http://[::1]:1/")


def test_a_page_that_does_not_keep_up_gets_no_more():
    page = Pages(3.0).add()
    numbers = [page.next_state() for _ in range(MAX_AHEAD + 5)]
    assert numbers[:MAX_AHEAD] == list(range(1, MAX_AHEAD + 1))
    assert numbers[MAX_AHEAD:] == [None] * 5
    page.has_drawn(10)
    assert page.next_state() == MAX_AHEAD + 1


def test_a_silent_page_is_lost_once_and_an_answer_counts():
    pages = Pages(1.0)
    page, other = pages.add(), pages.add()
    lost = []
    for _ in range(30):
        other.has_drawn(other.next_state() or 0)
        lost += pages.tick(0.1)
    assert lost == [page]
    page.has_drawn(10**6)  # never sent
    assert page.silence > 1.0
    page.has_drawn(page.next_state())
    assert page.silence == 0.0


def test_our_own_delay_is_not_the_pages_silence():
    pages = Pages(1.0)
    pages.add()
    assert pages.tick(30.0) == []
    assert pages.tick(LONGEST_TICK) == []


def test_pages_are_limited():
    pages = Pages(1.0)
    made = [pages.add() for _ in range(MAX_PAGES)]
    assert pages.add() is None
    pages.remove(made[0])
    pages.remove(made[0])
    assert pages.add() is not None

"""Ways to spoil bytes, texts and documents, drawn by a generator: the same seed spoils the same way."""

from __future__ import annotations

import copy
import random
from collections.abc import Callable
from typing import Any

import yaml

WEIRD: tuple[Any, ...] = (
    *(None, True, "", "nan", "-", "\x00", "é" * 3000, "../../etc/passwd", "1e5", "2001-99-99"),
    *(0, -1, 2**63, 10**400, -(10**30), 1e308, 5e-324, float("nan"), float("inf"), float("-inf")),
    *([], {}, [[[]]], {"a": {"b": []}}, [None] * 40, list(range(300)), {"x": float("nan")}),
)
BOMB = "a: &a [x,x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{b}: &{b} [{','.join([f'*{a}'] * 10)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
"""A hundred million values in nine lines."""
TEXTS: tuple[bytes, ...] = (
    *(b"", b"\n", b"---\n...\n---\n", b"\x00" * 64, b"\xff\xfe\x00\x00", bytes(range(256)) * 8, b"[" * 200_000),
    *(b"- " * 100_000, b"a: !!python/object/apply:os.system [false]\n", BOMB.encode(), b"a: *nowhere\n", b"\t\n"),
    *(b"a: !!timestamp x\n", b"a: 2001-99-99\n", b"? {a: 1}\n: 2\n", b"a: 0x_\n", b'{"a": ' * 5000, b"9" * 6000),
    *(b"just a line of text\n", b"- 1\n- 2\n", b"<html></html>", b"null", b"%YAML 9.9\n---\na: 1\n"),
)


def spoil_bytes(data: bytes, draw: random.Random) -> bytes:
    """Truncated, flipped, wiped, doubled, cut out, or with more at its end."""
    at = draw.randrange(len(data))
    end = min(len(data), at + 1 + draw.randrange(max(1, len(data) // 4)))
    flipped = bytearray(data)
    for _ in range(draw.choice((1, 200))):
        flipped[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    return draw.choice(
        (
            data[:at],
            data[: -1 - draw.randrange(min(200, len(data) - 1))],
            bytes(flipped),
            data[:at] + bytes(end - at) + data[end:],
            data[:at] + data[end:],
            data[:end] + data[at:],
            data + draw.randbytes(end - at),
        )
    )


def spoil_text(text: str, draw: random.Random) -> bytes:
    """A text that is cut, in another encoding, or something else altogether."""
    kind = draw.randrange(6)
    if kind == 0:
        return text.encode()[: draw.randrange(len(text))]
    if kind == 1:
        return text.encode(draw.choice(["utf-16", "utf-32", "cp500", "utf-8-sig"]))
    if kind == 2:
        return spoil_bytes(text.encode(), draw)
    if kind == 3:
        return text.replace("\n", draw.choice(["\r", "\n\n\t", "\n:", "\n- "]), draw.randrange(1, 9)).encode()
    return draw.choice(TEXTS)


def spoil_document(document: Any, draw: random.Random) -> Any:
    """One to three of its values replaced, removed, moved or doubled."""
    spoilt = copy.deepcopy(document)
    for _ in range(draw.choice((1, 1, 1, 2, 3))):
        places = list(_places(spoilt))
        if not places:
            return draw.choice(WEIRD)
        holder, key = draw.choice(places)
        kind = draw.randrange(6)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[draw.choice(["extra", "Sensor", "", "runs", 3, None])] = holder.pop(key)
        elif kind == 1:
            holder.insert(0, holder[key])
        else:
            holder[key] = copy.deepcopy(draw.choice(WEIRD))
    return spoilt


def _places(node: Any) -> Any:
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield node, key
        yield from _places(value)


def spoil_yaml(text: str, draw: random.Random) -> bytes:
    """A YAML text, spoilt in its bytes or in its meaning."""
    if draw.random() < 0.35:
        return spoil_text(text, draw)
    dump: Callable[..., str] = yaml.safe_dump
    return dump(spoil_document(yaml.safe_load(text), draw), allow_unicode=True).encode("utf-8", "surrogateescape")

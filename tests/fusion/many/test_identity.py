"""A report's checksum changes with everything that it rests on, and with nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gsense_fusion.closing import Request
from gsense_fusion.identification.types import Role
from gsense_fusion.many import identity
from gsense_fusion.many.identity import key_of


@pytest.fixture
def request_(tmp_path: Path) -> Request:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}_0.mcap").write_bytes(b"data of " + name.encode())
    (tmp_path / "mine.py").write_text("x = 1")
    bags = ((tmp_path / "a", Role.FIT), (tmp_path / "b", Role.HELD_OUT))
    return Request(bags, "mpu6050", effects=tmp_path / "mine.py")


def test_equal_questions_have_equal_keys(request_: Request) -> None:
    assert key_of(request_, "A7") == key_of(replace(request_), "A7")


def test_everything_counts(request_: Request, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changes: tuple[dict[str, Any], ...] = (
        {"sensor": "bno055"},
        {"declared": ("bias",)},
        {"latitude": 49.2, "rail_azimuth": 30.0},
        {"effects": None},
        {"bags": request_.bags[::-1]},
        {"bags": request_.bags[:1]},
        {"bags": ((tmp_path / "a", Role.FIT), (tmp_path / "b", Role.FIT))},
    )
    keys = [key_of(request_, None), key_of(request_, "A7")]
    keys += [key_of(replace(request_, **change), None) for change in changes]
    (tmp_path / "mine.py").write_text("x = 2")
    keys.append(key_of(request_, None))
    (tmp_path / "a" / "a_0.mcap").write_bytes(b"date of a")
    keys.append(key_of(request_, None))
    (tmp_path / "a" / "a_0.mcap").rename(tmp_path / "a" / "a_1.mcap")
    keys.append(key_of(request_, None))
    monkeypatch.setattr(identity, "program_digest", lambda: "another version")
    keys.append(key_of(request_, None))
    assert len(set(keys)) == len(keys)


def test_a_bag_that_is_not_there_is_an_error(request_: Request, tmp_path: Path) -> None:
    with pytest.raises(OSError, match="gone"):
        key_of(replace(request_, bags=((tmp_path / "gone", Role.FIT),)), None)

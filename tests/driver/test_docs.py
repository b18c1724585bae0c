from pathlib import Path

from gsense_driver import raw_log
from gsense_driver.settings import PARAMETERS, TRANSPORT_DELAY

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "driver.md").read_text(encoding="utf-8")


def test_every_parameter_is_described_with_its_range():
    for parameter in PARAMETERS:
        (row,) = [line for line in TEXT.splitlines() if line.startswith(f"| `{parameter.name}` |")]
        assert parameter.description in row
        if parameter.low is not None:
            assert f"| {parameter.low:g} to {parameter.high:g} |" in row
        assert ("| yes |" in row) == parameter.live
    assert f"| `{TRANSPORT_DELAY}` |" in TEXT


def test_every_kind_of_the_raw_log_is_described():
    for kind in raw_log.Kind:
        assert f"| {kind.value} {kind.name} |" in TEXT
    assert raw_log.MAGIC.decode() in TEXT
    assert raw_log.SCHEMA in TEXT

import pytest

from gsense_driver.user_input.yaml_text import parse_yaml


def test_plain_values():
    assert parse_yaml("a: [1, 2.5, x]\nb: {c: null, d: true}\n") == {"a": [1, 2.5, "x"], "b": {"c": None, "d": True}}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a: 1\nb: [1,\n", "line 3: not YAML"),
        ("a: 1\n\tb: 2\n", "line 2: not YAML"),
        ("when: 2020-99-01\n", "not YAML (ValueError: month must be in 1..12)"),
        ("a: !!python/object:os.system {}\n", "line 1: not YAML"),
        ("[" * 200_000, "nested too deep"),
    ],
)
def test_what_is_none_is_one_line(text, told):
    with pytest.raises(ValueError) as error:  # noqa: PT011 - looked at below
        parse_yaml(text)
    assert str(error.value).startswith(told)
    assert "\n" not in str(error.value)

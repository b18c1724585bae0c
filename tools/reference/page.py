"""The page: tables of what `graph`, `commands` and `packages` found."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from gsense_driver.user_input.node_help import Parameter, allowed, shown
from reference import graph, packages, words
from reference.commands import options, parser_of
from reference.graph import FILTER, SENSOR, Endpoint, Notes

HEAD = """# Interfaces

Made of the code by `./rig exec python tools/interfaces.py`; do not edit. `tests/docs/test_interfaces.py` fails when it
is stale.

Relative names, root namespace by default; SI units, temperatures in degrees Celsius; axes and signs REP-103, IMUs
REP-145. All publishers are reliable, volatile and keep last. `<sensor>` is the node's parameter `sensor`, `<filter>`
each of `filter`. A *live* parameter may change while the node works.
"""


def page() -> str:
    """The whole page."""
    nodes = graph.nodes()
    parts = [HEAD, _nodes(nodes), _messages(), _launch(), _commands(nodes), _files()]
    return "\n".join(part.strip() + "\n" for part in parts)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [list(head), *map(list, rows)]
    lines.insert(1, ["---"] * len(lines[0]))
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def _said(known: Mapping[str, Any], name: str) -> Any:
    if name not in known:
        raise SystemExit(f"tools/reference/words.py says nothing of {name}: add it there")
    return known[name]


def _nodes(nodes: Mapping[str, Notes]) -> str:
    parts = ["## Nodes\n"]
    for name, notes in nodes.items():
        parts.append(f"### {name}\n")
        if notes.parameters:
            parts.append(_table(("parameter", "type", "default", "allowed", "live", "meaning"), _parameters(notes)))
        if notes.publishes:
            parts.append(_endpoints("publishes", notes.publishes))
        if notes.subscribes:
            parts.append(_endpoints("subscribes", notes.subscribes))
        if name == "gsense_rig record":
            parts.append("Subscribes whatever is published, as deep as it is published.\n")
        if name == "gsense_rig dashboard":
            parts.append("Subscribes sensors and the filters that a page shows as they appear, best effort.\n")
        parts += _requests("service", notes.services, words.SERVICES)
        parts += _requests("action", notes.actions, words.ACTIONS)
    return "\n".join(parts)


def _requests(kind: str, found: list[tuple[str, str]], known: Mapping[str, str]) -> list[str]:
    rows = [(f"`{name}`", type_, _said(known, name)) for name, type_ in found]
    return [_table((kind, "type", "what it does"), rows)] if rows else []


def _parameters(notes: Notes) -> Iterable[tuple[str, ...]]:
    for parameter in notes.parameters:
        live = "" if parameter.descriptor.read_only else "yes"
        yield (
            f"`{parameter.name}`", _kind(parameter), _value(parameter), allowed(parameter.descriptor), live,
            parameter.descriptor.description,
        )  # fmt: skip


def _kind(parameter: Parameter) -> str:
    if parameter.descriptor.dynamic_typing:
        return "any"
    default = parameter.default
    if isinstance(default, list):
        return f"{_name(default[0])}[]"
    return _name(default)


def _name(value: object) -> str:
    return {str: "string", float: "double", bool: "bool", int: "integer"}[type(value)]


def _value(parameter: Parameter) -> str:
    return "computed" if parameter.name == "transport_delay" else shown(parameter.default)


def _endpoints(word: str, endpoints: Iterable[Endpoint]) -> str:
    rows = []
    for endpoint in endpoints:
        name = endpoint.name
        if word == "subscribes" or FILTER in name or name.endswith("residual"):
            name = name.replace(FILTER, "<filter>").replace(SENSOR, "<sensor>")
        said = _said(words.TOPICS, name)
        rows.append((f"`{name}`", endpoint.type, said.rate, endpoint.qos, said.content))
    return _table((word, "type", "Hz", "QoS", "content"), rows)


def _messages() -> str:
    parts = ["## Messages and actions of gsense_msgs\n"]
    for name, text in packages.messages().items():
        parts.append(f"### {name}\n\n```text\n{text.strip()}\n```\n")
    return "\n".join(parts)


def _launch() -> str:
    parts = ["## Launch files\n"]
    for name, arguments in packages.launch_files().items():
        rows = [(f"`{a.name}`", f"`{a.default}`" if a.default else "", a.text) for a in arguments]
        parts.append(f"### {name}\n\n{_table(('argument', 'default', 'meaning'), rows)}")
    return "\n".join(parts)


def _commands(nodes: Mapping[str, Notes]) -> str:
    parts = [
        "## Commands\n",
        "`ros2 run PACKAGE COMMAND` or `./rig run PACKAGE COMMAND`. Exit code 2: unusable input, a line on stderr.\n",
        "`gsense_driver board` is the [host board](../firmware/README.md#the-host-board); `--help` has its options.\n",
    ]
    for executable in packages.executables():
        name = f"{executable.package} {executable.name}"
        if name == "gsense_driver board" or (name in nodes and executable.name != "record"):
            continue
        parser = parser_of(executable)
        if parser is None:
            raise SystemExit(f"{name} has no parser: if it is a node, add it to tools/reference/graph.py")
        rows = [(f"`{o.names}`", o.value, o.default, o.text) for o in options(parser)]
        parts.append(f"### {name}\n\n{_table(('argument', 'value', 'default', 'meaning'), rows)}")
    return "\n".join(parts)


def _files() -> str:
    schemas = [(f"`{name}`", _said(words.SCHEMAS, name)) for name in packages.schemas()]
    variables = [(f"`{name}`", _said(words.VARIABLES, name)) for name in packages.environment_variables()]
    return "\n".join([
        "## Files\n", _table(("schema", "written by"), schemas),
        "Bags are rosbag2's (MCAP or SQLite3), one run each. Plans: [campaigns](campaigns.md#a-plan).\n",
        "## Environment variables\n", _table(("variable", "meaning"), variables),
    ])  # fmt: skip

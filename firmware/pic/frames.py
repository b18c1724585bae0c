"""A section for each function's local variables.

SDCC's pic14 port overlays the locals of functions that do not call one another, in one section for the whole file,
which is then larger than a bank of 80 bytes. It leaves out bank selections between variables of a section, so the
section cannot be split as it stands. No local carries a value from one function to another (arguments and results go
by W and STKxx): each function gets locals of its own, in a section of its own.
"""

from __future__ import annotations

import re

_RESERVED = re.compile(r"^(\w+)\tres\t(\d+)$")
_FUNCTION = re.compile(r"^(?:S_\w+|c_interrupt)\tcode")
_WORD = re.compile(r"\w+")


def _marked(line: str, names: list[str], mark: str) -> str:
    return _WORD.sub(lambda match: f"{mark}{match[0]}" if match[0] in names else match[0], line)


def own_locals(text: str) -> str:
    """The assembler source with the locals renamed and put into one section a function."""
    lines = text.split("\n")
    start = next((i for i, line in enumerate(lines) if line.startswith("UDL_")), None)
    if start is None:
        return text
    end = start + 1
    sizes: dict[str, str] = {}
    while match := _RESERVED.match(lines[end]):
        sizes[match[1]] = match[2]
        end += 1
    used: list[dict[str, None]] = []
    body: list[str] = []
    for line in lines[end:]:
        if _FUNCTION.match(line):
            used.append({})
        if used and not line.lstrip().startswith(";"):
            found = [word for word in _WORD.findall(line) if word in sizes]
            used[-1].update(dict.fromkeys(found))
            body.append(_marked(line, found, f"l{len(used) - 1}"))
        else:
            body.append(line)
    sections: list[str] = []
    for number, names in enumerate(used):
        if names:
            sections.append(f"locals_{number}\tudata")
            sections += [f"l{number}{name}\tres\t{sizes[name]}" for name in names]
    return "\n".join(lines[:start] + sections + body)

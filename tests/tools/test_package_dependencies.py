"""Each package.xml names what its package imports and runs, by keys that rosdep knows."""

from __future__ import annotations

import ast
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("gsense_driver", "gsense_rig", "gsense_fusion")
KEYS = {
    "cobs": "python-cobs-pip",
    "jinja2": "python3-jinja2",
    "matplotlib": "python3-matplotlib",
    "numba": "python3-numba",
    "numpy": "python3-numpy",
    "rich": "python3-rich",
    "rosbags": "python3-rosbags-pip",
    "scipy": "python3-scipy",
    "serial": "python3-serial",
    "tornado": "python3-tornado",
    "yaml": "python3-yaml",
}
"""Module -> key in rosdep/python.yaml of rosdistro (2026)."""
BROUGHT_ALONG = {"markupsafe": "jinja2", "lz4": "rosbags", "backports": "rosbags", "mpl_toolkits": "matplotlib"}
"""Module -> the module whose package depends on it."""
WITHOUT_KEY = {"vqf", "allantools", "distributed"}
NOT_IMPORTED = {
    "gsense_rig": {"launch_ros", "ros2launch", "robot_state_publisher", "gsense_fusion"},
    "gsense_driver": {"gsense_firmware"},
}
"""Dependencies of launch files and of what is started as a process."""
SHARED = "gsense_driver.user_input"
"""All else that the parts of the graph have in common is on topics, in bags and in files (docs/architecture.md)."""


def modules(package: str) -> set[str]:
    """Modules that are imported, by their whole names."""
    found: set[str] = set()
    for path in (ROOT / "src" / package / package).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
                found.add(node.module)
    return found


def imported(package: str) -> set[str]:
    """Top-level modules that are not Python's own and not the package itself."""
    found = {name.partition(".")[0] for name in modules(package)}
    return found - set(sys.stdlib_module_names) - {package, "compression"}


def dependencies(package: str) -> set[str]:
    root = ET.parse(ROOT / "src" / package / "package.xml").getroot()
    return {str(item.text) for tag in ("depend", "exec_depend") for item in root.findall(tag)}


@pytest.mark.parametrize("package", PACKAGES)
def test_what_is_imported_is_declared(package: str) -> None:
    found = imported(package)
    assert {BROUGHT_ALONG[m] for m in found & set(BROUGHT_ALONG)} <= found
    needed = {KEYS.get(m, m) for m in found - WITHOUT_KEY - set(BROUGHT_ALONG)}
    assert needed <= dependencies(package), f"missing in package.xml: {needed - dependencies(package)}"


@pytest.mark.parametrize("package", PACKAGES)
def test_what_is_declared_is_used(package: str) -> None:
    beside = NOT_IMPORTED.get(package, set())
    used = {KEYS.get(m, m) for m in imported(package)} | beside
    assert beside <= dependencies(package)
    assert dependencies(package) <= used, f"unused: {dependencies(package) - used}"


def test_the_parts_of_the_graph_do_not_import_one_another() -> None:
    across = {
        (package, name)
        for package in PACKAGES
        for name in modules(package)
        if name.partition(".")[0] in {*PACKAGES} - {package} and not f"{name}.".startswith(f"{SHARED}.")
    }
    assert across == set()


def test_what_has_no_key_has_its_pip_line_in_the_manual() -> None:
    used = set.union(*(imported(package) for package in PACKAGES))
    assert used >= WITHOUT_KEY
    assert used - WITHOUT_KEY - set(KEYS) - set(BROUGHT_ALONG) - _ros() == set()
    lines = re.findall(r"pip install .*", (ROOT / "docs" / "install.md").read_text(encoding="utf-8"))
    assert any(set(line.split()) >= WITHOUT_KEY for line in lines)


def _ros() -> set[str]:
    return {name for package in PACKAGES for name in dependencies(package)} | set(PACKAGES) | {"ament_index_python"}


def test_all_packages_have_one_form_and_a_maintainer() -> None:
    for path in [*ROOT.glob("src/*/package.xml"), ROOT / "firmware/package.xml"]:
        root = ET.parse(path).getroot()
        assert root.get("format", "3") in ("2", "3")
        for tag in ("name", "version", "description", "maintainer", "license"):
            assert root.findtext(tag), f"{path}: {tag}"

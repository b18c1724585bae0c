"""Installs gsense_driver as an ament_python package."""

import re
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = "gsense_driver"
VERSION = re.findall("<version>(.*)</version>", Path(__file__).with_name("package.xml").read_text(encoding="utf-8"))[0]

setup(
    name=PACKAGE,
    version=VERSION,
    description="Reads the board's frames from a serial line and publishes them as ROS 2 messages.",
    license="Apache-2.0",
    maintainer="gsense developers",
    maintainer_email="gsense@example.org",
    python_requires=">=3.10",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={"": ["py.typed", "*.html", "*.j2", "*.yaml", "*.css", "*.js", "*.svg"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/config", ["config/bridge.yaml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": [
            "bridge = gsense_driver.bridge_node:main",
            "board = gsense_driver.board:main",
            "monitor = gsense_driver.monitor:main",
            "replay = gsense_driver.replay:main",
        ],
    },
)

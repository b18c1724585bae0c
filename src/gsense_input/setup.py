"""Installs gsense_input as an ament_python package."""

import re
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = "gsense_input"
VERSION = re.findall("<version>(.*)</version>", Path(__file__).with_name("package.xml").read_text(encoding="utf-8"))[0]

setup(
    name=PACKAGE,
    version=VERSION,
    description="What people write: arguments, parameters, YAML. What is wrong with it is one line.",
    license="Apache-2.0",
    maintainer="gsense developers",
    maintainer_email="gsense@example.org",
    python_requires=">=3.10",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={"": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
)

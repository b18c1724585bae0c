"""Installs gsense_fusion as an ament_python package."""

import re
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = "gsense_fusion"
VERSION = re.findall("<version>(.*)</version>", Path(__file__).with_name("package.xml").read_text(encoding="utf-8"))[0]

setup(
    name=PACKAGE,
    version=VERSION,
    description="Attitude with and without g-compensation, and the effect that the declared model lacks.",
    license="Apache-2.0",
    maintainer="gsense developers",
    maintainer_email="gsense@example.org",
    python_requires=">=3.10",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={"": ["py.typed", "*.html", "*.j2", "*.yaml", "*.css", "*.js", "*.svg"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/config", ["config/fusion.yaml"]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": [
            "fusion = gsense_fusion.fusion_node:main",
            "replay = gsense_fusion.replay:main",
            "close_loop = gsense_fusion.close_loop:main",
            "noise = gsense_fusion.noise:main",
            "calibrate = gsense_fusion.calibrate:main",
            "watch = gsense_fusion.watch_node:main",
        ],
    },
)

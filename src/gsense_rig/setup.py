"""Installs gsense_rig as an ament_python package."""

import re
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = "gsense_rig"
VERSION = re.findall("<version>(.*)</version>", Path(__file__).with_name("package.xml").read_text(encoding="utf-8"))[0]

setup(
    name=PACKAGE,
    version=VERSION,
    description="Controls the linear rail, or simulates it, and records what the graph publishes.",
    license="Apache-2.0",
    maintainer="gsense developers",
    maintainer_email="gsense@example.org",
    python_requires=">=3.10",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={
        "": ["py.typed", "*.html", "*.j2", "*.yaml", "*.css", "*.js", "*.svg"],
        f"{PACKAGE}.dashboard": ["static/*"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/config", ["config/record_qos.yaml", "config/rig.yaml", "config/demo.yaml"]),
        (f"share/{PACKAGE}/layouts", ["layouts/foxglove.json", "layouts/plotjuggler.xml"]),
        (f"share/{PACKAGE}/rviz", ["rviz/gsense.rviz"]),
        (f"share/{PACKAGE}/sros2", ["sros2/policy.xml"]),
        (f"share/{PACKAGE}/urdf", ["urdf/rig.urdf"]),
        (f"share/{PACKAGE}/system", ["system/99-gsense.rules", "system/gsense.service"]),
        (f"share/{PACKAGE}/launch", [f"launch/{name}.launch.xml" for name in ("demo", "rig", "analysis")]),
    ],
    zip_safe=False,
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": [
            "rig = gsense_rig.rig_node:main",
            "faults = gsense_rig.faults:main",
            "record = gsense_rig.record:main",
            "tracking = gsense_rig.tracking:main",
            "simulate = gsense_rig.simulate:main",
            "plot_run = gsense_rig.plot_run:main",
            "campaign = gsense_rig.campaign.command:main",
            "dashboard = gsense_rig.dashboard.command:main",
            "demo = gsense_rig.demo:main",
        ],
    },
)

"""`--help` of a node tells its parameters where there is no `ros2 param describe`."""

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

from gsense_driver.user_input.node_help import node_parser


def declare(node):
    node.declare_parameter("port", "", ParameterDescriptor(description="device"))
    low_high = [FloatingPointRange(from_value=0.5, to_value=60.0)]
    node.declare_parameter("wait", 3.0, ParameterDescriptor(description="patience, s", floating_point_range=low_high))
    whole = [IntegerRange(from_value=0, to_value=9)]
    node.declare_parameter("seed", 1, ParameterDescriptor(description="draws", integer_range=whole))
    port = node.get_parameter("port").value
    node.declare_parameter("quick", not port, ParameterDescriptor(description="at once"))
    words = ParameterDescriptor(description="how", additional_constraints="one of a, b")
    node.declare_parameter("ways", ["a", "b"], words)


def test_every_parameter_with_default_range_and_unit():
    text = node_parser("node", "What it does.", declare).format_help()
    assert text.startswith("usage: node [--ros-args -p NAME:=VALUE ...]\n\nWhat it does.\n")
    told = text.partition("parameters, ")[2].splitlines()[1:]
    assert told == [
        "  port (default: empty)",
        "        device",
        "  wait (default: 3)",
        "        patience, s; 0.5 to 60",
        "  seed (default: 1)",
        "        draws; 0 to 9",
        "  quick (default: true)",
        "        at once",
        "  ways (default: a, b)",
        "        how; one of a, b",
    ]


def test_arguments_are_refused(capsys):
    with pytest.raises(SystemExit) as ended:
        node_parser("node", "What it does.", declare).parse_args(["--port", "x"])
    assert ended.value.code == 2
    assert capsys.readouterr().err == "node: unrecognized arguments: --port x; node --help lists what it takes\n"

"""A node does not keep silent about a parameter that it does not have."""

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")

import rclpy
from tests.domains import own_domain

from gsense_driver.user_input.parameters import UnknownParameterError, refuse_unknown
from reference.graph import nodes

PARAMETERS = {"port": "", "baud": 460800, "unit_id": "", "bno055.gyro_lsb_per_dps": 16.0}


@pytest.fixture(scope="module", autouse=True)
def domain():
    with own_domain():
        yield


def answer(*words, declared=PARAMETERS, namespace="/lab"):
    """What a node `bridge` says of its command line: the message, or None."""
    context = rclpy.Context()
    arguments = ["bridge", "--ros-args", "-r", f"__ns:={namespace}", *words]
    rclpy.init(context=context, args=arguments)
    node = rclpy.create_node("bridge", context=context)
    try:
        for name, default in declared.items():
            node.declare_parameter(name, default)
        refuse_unknown(node, arguments)
    except UnknownParameterError as error:
        return str(error)
    finally:
        node.destroy_node()
        context.try_shutdown()
    return None


def file(folder, text):
    path = folder / "parameters.yaml"
    path.write_text(text)
    return "--params-file", str(path)


@pytest.mark.parametrize("word", ["-p", "--param"])
@pytest.mark.parametrize("name", ["prot", "bridge:prot"])
def test_a_mistyped_parameter_is_refused_with_the_nearest(word, name):
    assert answer(word, f"{name}:=/dev/x", namespace="/") == "parameter prot is unknown; the nearest one is port"


def test_a_parameter_that_resembles_none_is_refused_with_all():
    told = answer("-p", "colour:=red")
    assert told.startswith("parameter colour is unknown; this node has ")
    assert all(name in told for name in PARAMETERS)


@pytest.mark.parametrize(
    "words",
    [
        ("-p", "port:=/dev/x"),
        ("-p", "bno055.gyro_lsb_per_dps:=900.0"),
        ("-p", "use_sim_time:=false"),
        ("-p", "start_type_description_service:=false"),
        ("-p", "qos_overrides./lab/rig/pose.publisher.depth:=10"),
        ("-p", "fusion:filter:=vqf"),
    ],
)
def test_parameters_of_its_own_of_ros_and_of_another_node_are_taken(words):
    assert answer(*words) is None


@pytest.mark.parametrize(
    ("namespace", "section"),
    [("/", "bridge"), ("/", "/bridge"), ("/lab", "/lab/bridge"), ("/lab", "/**/bridge"), ("/lab", "lab:\n  bridge")],
)
def test_what_a_section_of_the_node_has_too_much_is_refused(tmp_path, namespace, section):
    indent = "  " if "\n" in section else ""
    text = f"{section}:\n{indent}  ros__parameters:\n{indent}    bno055: {{scale: 3}}\n"
    assert answer(*file(tmp_path, text), namespace=namespace).startswith("parameter bno055.scale is unknown; ")


@pytest.mark.parametrize("name", ["prot", "Port", "bauds", "unitid", "bno055.gyro_lsb_per_dsp"])
def test_in_a_section_for_all_nodes_only_a_slip_is_refused(tmp_path, name):
    text = "/**:\n  ros__parameters:\n    {}: 3\n"
    assert "the nearest one is " in answer(*file(tmp_path, text.format(name)))
    assert answer(*file(tmp_path, text.format("frame_rate"))) is None


def test_a_section_of_another_node_says_nothing_of_this_one(tmp_path):
    text = "/**:\n  ros__parameters: {filter: vqf}\nfusion:\n  ros__parameters: {filter: kalman}\n"
    assert answer(*file(tmp_path, text)) is None


def test_one_section_for_all_nodes_serves_the_whole_graph(tmp_path):
    of_nodes = {node: {parameter.name for parameter in notes.parameters} for node, notes in nodes().items()}
    everything = set.union(*of_nodes.values())
    for own in of_nodes.values():
        others = "".join(f"    {name}: 1\n" for name in everything - own)
        given = file(tmp_path, f"/**:\n  ros__parameters:\n{others}")
        assert answer(*given, declared=dict.fromkeys(own, 0)) is None

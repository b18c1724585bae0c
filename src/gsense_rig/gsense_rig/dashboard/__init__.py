"""The live rig as a local web page: what the graph publishes, and commands that go through the rig's node."""

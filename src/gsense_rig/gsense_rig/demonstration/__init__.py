"""The demonstration: starts the whole graph and the commands of every package as processes, and tells what happens."""

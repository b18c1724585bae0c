"""Makes docs/interfaces.md of the code: nodes are built in a graph that takes notes, commands show their parsers."""

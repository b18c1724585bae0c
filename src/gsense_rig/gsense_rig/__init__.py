"""Controls the linear rail, or simulates it, and records what the graph publishes."""

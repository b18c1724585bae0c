"""The long identification study and the simulator that it runs on."""

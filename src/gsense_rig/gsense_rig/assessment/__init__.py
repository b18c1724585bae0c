"""How well the rail is controlled: sines on plants that are not what the controller believes, judged by the truth."""

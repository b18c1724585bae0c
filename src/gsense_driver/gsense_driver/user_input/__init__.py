"""What people write: arguments, parameters, YAML. What is wrong with it is one line."""

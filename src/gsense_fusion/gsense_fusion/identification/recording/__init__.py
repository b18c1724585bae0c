"""What a recording says of itself before any model is fitted: stamps, clocks, lattice of values, magnetometer."""

"""The control loop: pure (`rig_loop`), on a virtual clock (`simulated`), in a process of its own (`process`)."""

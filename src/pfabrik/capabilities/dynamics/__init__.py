"""Forces of motion: what actuators exert, and joints transmit, to move the masses of a machine."""

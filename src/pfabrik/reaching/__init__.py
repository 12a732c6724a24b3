"""P-FABRIK on joint positions, by forward and backward passes, and its conversion from and to joint coordinates."""

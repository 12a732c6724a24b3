"""P-FABRIK on joint positions: passes, restrictions, projection, and the exact steps that finish them."""

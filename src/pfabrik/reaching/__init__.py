"""P-FABRIK on joint positions: targets answered by passes and closed forms; joints from positions and back."""

"""P-FABRIK on joint positions: targets answered by passes and closed forms; joint coordinates from positions and back."""

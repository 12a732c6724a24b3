"""P-FABRIK on joint positions: passes, restrictions, projection, and the exact step that finishes them."""

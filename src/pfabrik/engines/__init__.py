"""What answers targets: legs at a pose, joint coordinates, chains."""

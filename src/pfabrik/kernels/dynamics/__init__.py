"""Forces of motion: loops closed in rates, and masses along a tree."""

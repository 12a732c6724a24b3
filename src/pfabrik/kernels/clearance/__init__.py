"""Distances between links: capsules, spheres, boxes and discs."""

"""Configurations of legs in closed form in few unknowns: the pose of the platform, and what carries each rod."""

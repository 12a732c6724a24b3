"""Answers in the pose of the platform, its legs in closed form."""

"""Legs in closed form: coordinates and constraints at a pose, and poses completed until all legs close."""

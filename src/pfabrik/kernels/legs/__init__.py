"""Legs in closed form: what each says of a pose, and poses completed until all legs close."""

"""The fastest timing of a path, and the highest speeds of a platform."""

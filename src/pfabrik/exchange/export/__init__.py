"""Code and settings for controllers, from the description of a machine."""

"""Paths as people have them: CSV and G-code."""

"""Dimensions for what a machine must do, found by counterexample."""

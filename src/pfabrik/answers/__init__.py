"""Answers and their properties: active limits, margins, Jacobians, and descriptions in words."""

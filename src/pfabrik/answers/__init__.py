"""What an answer is, and what can be read of it: limits, margins, Jacobians, words."""

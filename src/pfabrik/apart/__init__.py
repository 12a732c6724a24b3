"""Links kept apart: their distances, and answers in which they keep the clearance."""

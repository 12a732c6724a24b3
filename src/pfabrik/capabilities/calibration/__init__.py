"""Parameters of a real machine: what answers owe to them, and their values from measurements."""

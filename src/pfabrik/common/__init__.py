"""What knows no machine: arrays, poses, checks, printed results."""

"""What a machine is: its description, files, decomposition and motions."""

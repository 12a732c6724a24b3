"""What a controller asks of a machine, one call at a time, with memory that is there before; exported as C."""

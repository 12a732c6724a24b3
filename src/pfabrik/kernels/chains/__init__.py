"""Serial chains of joints with limits: reached, and brought nearest, in time linear in the number of joints."""

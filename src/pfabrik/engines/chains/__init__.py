"""The engine of mechanisms without loops: the chain from the base to the end effector, in time linear in its joints."""

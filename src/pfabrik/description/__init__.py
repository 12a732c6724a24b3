"""What a machine is: bodies, joints and limits in the assembled home configuration, checked when it is made."""

"""The description of a machine: bodies, joints and limits in the assembled home configuration, checked when made."""

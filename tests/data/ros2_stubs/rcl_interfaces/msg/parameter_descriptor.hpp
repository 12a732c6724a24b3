// Stub of what the node sets in it.
#pragma once

namespace rcl_interfaces::msg
{
struct ParameterDescriptor
{
  bool read_only = false;
};
}  // namespace rcl_interfaces::msg

// Stub of what the node sets in it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rcl_interfaces::msg
{
struct FloatingPointRange
{
  double from_value = 0.0, to_value = 0.0, step = 0.0;
};
struct IntegerRange
{
  std::int64_t from_value = 0, to_value = 0;
  std::uint64_t step = 0;
};
struct ParameterDescriptor
{
  std::string description;
  std::vector<FloatingPointRange> floating_point_range;
  std::vector<IntegerRange> integer_range;
  bool read_only = false;
};
}  // namespace rcl_interfaces::msg

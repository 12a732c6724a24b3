// Stub of geometry_msgs/PoseStamped and TransformStamped.
#pragma once

#include "std_msgs/msg/header.hpp"

namespace geometry_msgs::msg
{
struct Point
{
  double x = 0.0, y = 0.0, z = 0.0;
};
using Vector3 = Point;
struct Quaternion
{
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
};
struct Pose
{
  Point position;
  Quaternion orientation;
};
struct PoseStamped
{
  std_msgs::msg::Header header;
  Pose pose;
};
struct Transform
{
  Vector3 translation;
  Quaternion rotation;
};
struct TransformStamped
{
  std_msgs::msg::Header header;
  std::string child_frame_id;
  Transform transform;
};
}  // namespace geometry_msgs::msg

// The node of '@MACHINE@': poses in, commands of actuators out. README.md has its topics and parameters.
// Written by pfabrik; the notice in @NAME@_platform.hpp is of this file too.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "@NAME@_platform.hpp"
#include "diagnostic_msgs/msg/diagnostic_array.hpp"
#include "geometry_msgs/msg/pose_stamped.hpp"
#include "rcl_interfaces/msg/parameter_descriptor.hpp"
#include "rclcpp/rclcpp.hpp"
#include "sensor_msgs/msg/joint_state.hpp"
#include "std_msgs/msg/float64_multi_array.hpp"
#include "tf2_msgs/msg/tf_message.hpp"

namespace @NAME@_node
{
using diagnostic_msgs::msg::DiagnosticStatus;
using geometry_msgs::msg::PoseStamped;
using sensor_msgs::msg::JointState;

class Node : public rclcpp::Node
{
public:
  Node() : rclcpp::Node("@NAME@"), platform_(settings())
  {
    base_frame_ = parameter<std::string>("base_frame", @BASE@);
    platform_frame_ = parameter<std::string>("platform_frame", @PLATFORM@);
    const auto command = choice("command", "array", {"array", "joint_state"});
    show_ = choice("show", "achieved", {"achieved", "measured", "nothing"});
    const double rate = number("show_rate", 30.0, 0.001, 1000.0);
    if (show_ == "measured" && !kHasForward) {
      throw std::invalid_argument("show: this machine's actuators do not determine its pose; expected achieved or nothing");
    }
    heard_.fill(kNaN);
    command_.data.resize(kActuators);
    command_state_.position.resize(kActuators);
    for (const Actuator & actuator : kActuatorTable) {
      command_state_.name.emplace_back(actuator.name);
    }
    shown_.position.resize(kJoints);
    for (std::size_t i = 0; i < kJoints; ++i) {
      shown_.name.emplace_back(kJointTable[i].name);
    }
    achieved_.header.frame_id = measured_.header.frame_id = base_frame_;
    transforms_.transforms.resize(1);
    transforms_.transforms[0].header.frame_id = base_frame_;
    transforms_.transforms[0].child_frame_id = platform_frame_;

    const rclcpp::QoS latest(1);
    if (command == "array") {
      command_publisher_ = create_publisher<std_msgs::msg::Float64MultiArray>("~/joint_command", latest);
    } else {
      command_state_publisher_ = create_publisher<JointState>("~/joint_command", latest);
    }
    achieved_publisher_ = create_publisher<PoseStamped>("~/achieved", latest);
    diagnostics_publisher_ = create_publisher<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", 10);
    target_subscription_ = create_subscription<PoseStamped>(
      "~/target", latest, [this](const PoseStamped & target) { on_target(target); });
    if (kHasForward) {
      measured_publisher_ = create_publisher<PoseStamped>("~/pose", latest);
      actuator_subscription_ = create_subscription<JointState>(
        "~/actuator_states", rclcpp::SensorDataQoS(), [this](const JointState & state) { on_actuators(state); });
    }
    if (show_ != "nothing") {
      joint_publisher_ = create_publisher<JointState>("~/joint_states", 10);
      transform_publisher_ = create_publisher<tf2_msgs::msg::TFMessage>("/tf", 100);
      const std::chrono::nanoseconds period(static_cast<std::int64_t>(1e9 / rate));
      show_timer_ = create_wall_timer(period, [this]() { show(); });
    }
    report_timer_ = create_wall_timer(std::chrono::seconds(1), [this]() { report(); });
  }

private:
  // A parameter that is read now and never again: setting it later is refused.
  template <typename T>
  T parameter(const char * name, const T & usual)
  {
    rcl_interfaces::msg::ParameterDescriptor descriptor;
    descriptor.read_only = true;
    return declare_parameter<T>(name, usual, descriptor);
  }

  template <typename T>
  T number(const char * name, T usual, T least, T most)
  {
    const T value = parameter<T>(name, usual);
    if (!(value >= least && value <= most)) {  // nor NaN
      const auto expected = text(least) + " to " + text(most);
      throw std::invalid_argument(std::string(name) + ": found " + text(value) + "; expected " + expected);
    }
    return value;
  }

  std::string choice(const char * name, const char * usual, const std::vector<std::string> & choices)
  {
    const auto value = parameter<std::string>(name, usual);
    std::string expected;
    for (const auto & each : choices) {
      if (value == each) {
        return value;
      }
      expected += (expected.empty() ? "" : ", ") + each;
    }
    throw std::invalid_argument(std::string(name) + ": found '" + value + "'; expected one of " + expected);
  }

  Settings settings()
  {
    Settings settings;
    const char * usual = kHasNearest ? "project" : "hold";
    settings.projects = choice("out_of_reach", usual, {"project", "hold"}) == "project";
    if (settings.projects && !kHasNearest) {
      throw std::invalid_argument("out_of_reach: no nearest pose is found for this machine; expected hold");
    }
    settings.steps = static_cast<int>(number<std::int64_t>("steps", settings.steps, 1, 10000));
    settings.starts = static_cast<int>(number<std::int64_t>("starts", settings.starts, 0, 10000));
    settings.largest_step = number("largest_step", settings.largest_step, 0.0, 1e6);
    return settings;
  }

  void on_target(const PoseStamped & target)
  {
    const auto & at = target.pose.position;
    const auto & q = target.pose.orientation;
    is_in_frame_ = target.header.frame_id == base_frame_;
    if (!is_in_frame_) {
      frame_ = target.header.frame_id;
    }
    const Status before = platform_.status();
    const Status status =
      is_in_frame_ ? platform_.target({{at.x, at.y, at.z}, {q.x, q.y, q.z, q.w}}) : platform_.refuse();
    ++counts_[static_cast<std::size_t>(status)];
    if (status == Status::kReached || status == Status::kProjected) {
      const auto & actuators = platform_.commanded().actuators;
      if (command_publisher_) {
        std::copy(actuators.begin(), actuators.end(), command_.data.begin());
        command_publisher_->publish(command_);
      } else {
        std::copy(actuators.begin(), actuators.end(), command_state_.position.begin());
        command_state_.header.stamp = now();
        command_state_publisher_->publish(command_state_);
      }
      put(platform_.commanded().pose, achieved_.pose);
      achieved_.header.stamp = target.header.stamp;
      achieved_publisher_->publish(achieved_);
    }
    if (status != before) {
      report();
    }
  }

  // Names in any order, others among them. Several may publish, each a part: the rest is as it was last heard.
  void on_actuators(const JointState & state)
  {
    is_heard_ = true;
    bool has_any = false;
    for (std::size_t i = 0; i < kActuators; ++i) {
      std::size_t k = 0;
      while (k < state.name.size() && state.name[k] != kActuatorTable[i].name) {
        ++k;
      }
      if (k < state.name.size() && k < state.position.size()) {
        heard_[i] = state.position[k];
        has_any = true;
      }
    }
    if (!has_any || missing() < kActuators) {
      return;
    }
    const int code = measured_code_ = platform_.measure(heard_);
    if (@IS_MEASURED@) {
      put(platform_.measured().pose, measured_.pose);
      measured_.header.stamp = state.header.stamp;
      measured_publisher_->publish(measured_);
    }
  }

  // The first actuator without a position so far, or whose last one is NaN; kActuators: none.
  std::size_t missing() const
  {
    const auto at = std::find_if(heard_.begin(), heard_.end(), [](double value) { return std::isnan(value); });
    return static_cast<std::size_t>(at - heard_.begin());
  }

  // Joint states and the transform of what is shown: home until the first target, or measurement.
  void show()
  {
    const Configuration & at = show_ == "measured" ? platform_.measured() : platform_.commanded();
    auto & transform = transforms_.transforms[0];
    shown_.header.stamp = transform.header.stamp = now();
    std::copy(at.joints.begin(), at.joints.end(), shown_.position.begin());
    joint_publisher_->publish(shown_);
    geometry_msgs::msg::Pose pose;
    put(at.pose, pose);
    transform.transform.translation.x = pose.position.x;
    transform.transform.translation.y = pose.position.y;
    transform.transform.translation.z = pose.position.z;
    transform.transform.rotation = pose.orientation;
    transform_publisher_->publish(transforms_);
  }

  static void put(const @NAME@_pose & from, geometry_msgs::msg::Pose & to)
  {
    const Pose pose = Platform::pose_of(from);
    to.position.x = pose.position[0];
    to.position.y = pose.position[1];
    to.position.z = pose.position[2];
    to.orientation.x = pose.quaternion[0];
    to.orientation.y = pose.quaternion[1];
    to.orientation.z = pose.quaternion[2];
    to.orientation.w = pose.quaternion[3];
  }

  void report()
  {
    diagnostic_msgs::msg::DiagnosticArray array;
    array.header.stamp = now();
    array.status.push_back(of_target());
    if (is_heard_) {
      array.status.push_back(of_actuators());
    }
    diagnostics_publisher_->publish(array);
  }

  DiagnosticStatus of_target() const
  {
    const Status is = platform_.status();
    DiagnosticStatus status = named("target", word(is));
    const bool is_well = is == Status::kWaiting || is == Status::kReached;
    status.level = is == Status::kRefused ? DiagnosticStatus::ERROR : is_well ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
    if (is == Status::kRefused && !is_in_frame_) {
      status.message += ": found frame '" + frame_ + "'; expected '" + base_frame_ + "'";
    } else if (!is_well) {
      status.message += std::string(": ") + platform_.reason();
    }
    if (platform_.jump() < kActuators) {
      status.message += std::string(": ") + kActuatorTable[platform_.jump()].name;
    }
    std::string active;
    for (std::size_t i = 0; i < kLimits; ++i) {
      if (platform_.is_active(i)) {
        active += (active.empty() ? "" : "; ") + std::string(kLimitTable[i].name);
      }
    }
    if (platform_.dead_point() != 0) {
      const std::string words(@NAME@_what(platform_.dead_point()));
      const bool is_leg = platform_.dead_point() < 10 * @MACRO@_LEG;
      active += (active.empty() ? "" : "; ") + (is_leg ? "stretched" + words.substr(words.find(':')) : words);
    }
    if (platform_.pair() != 0) {
      std::string words(@NAME@_what(@PAIR@));
      words.erase(0, words.find(": ") + 2);
      add(status, "nearest links", words);
      add(status, "between them [m]", text(platform_.between_links()));
      if (platform_.between_links() <= kClearance + kRounding) {
        active += (active.empty() ? "" : "; ") + words + " min " + text(kClearance) + " m";
      }
    }
    add(status, "active limits", active);
    add(status, "jumped", platform_.has_jumped() ? "true" : "false");
    add(status, "distance from target [m]", text(platform_.distance()));
    add(status, "rotation from target [rad]", text(platform_.angle()));
    const std::size_t nearest = platform_.nearest_limit();
    add(status, "nearest limit", nearest < kLimits ? kLimitTable[nearest].name : "");
    add(status, "margin [m or rad]", nearest < kLimits ? text(platform_.room(nearest)) : "");
    for (const Status each : {Status::kReached, Status::kProjected, Status::kHeld, Status::kRefused}) {
      add(status, word(each), std::to_string(counts_[static_cast<std::size_t>(each)]));
    }
    return status;
  }

  DiagnosticStatus of_actuators() const
  {
    DiagnosticStatus status = named("actuators", "measured");
    status.level = DiagnosticStatus::OK;
    if (missing() < kActuators) {
      status.level = DiagnosticStatus::ERROR;
      status.message = std::string("no position of ") + kActuatorTable[missing()].name;
    } else if (measured_code_ != 0) {
      status.level = DiagnosticStatus::WARN;
      status.message = @NAME@_what(measured_code_);
    }
    return status;
  }

  DiagnosticStatus named(const char * part, const char * message) const
  {
    DiagnosticStatus status;
    status.name = std::string(get_name()) + ": " + part;
    status.hardware_id = @MACHINE_TEXT@;
    status.message = message;
    return status;
  }

  static std::string text(double value)
  {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.6g", value);
    return digits;
  }

  static std::string text(std::int64_t value) { return std::to_string(value); }

  static void add(DiagnosticStatus & status, const char * key, const std::string & value)
  {
    diagnostic_msgs::msg::KeyValue pair;
    pair.key = key;
    pair.value = value;
    status.values.push_back(pair);
  }

  Platform platform_;
  std::string base_frame_, platform_frame_, show_, frame_;
  bool is_in_frame_ = true, is_heard_ = false;
  std::array<double, kActuators> heard_;
  int measured_code_ = 0;
  std::array<std::size_t, 5> counts_{};
  std_msgs::msg::Float64MultiArray command_;
  JointState command_state_, shown_;
  PoseStamped achieved_, measured_;
  tf2_msgs::msg::TFMessage transforms_;
  rclcpp::Publisher<std_msgs::msg::Float64MultiArray>::SharedPtr command_publisher_;
  rclcpp::Publisher<JointState>::SharedPtr command_state_publisher_, joint_publisher_;
  rclcpp::Publisher<PoseStamped>::SharedPtr achieved_publisher_, measured_publisher_;
  rclcpp::Publisher<diagnostic_msgs::msg::DiagnosticArray>::SharedPtr diagnostics_publisher_;
  rclcpp::Publisher<tf2_msgs::msg::TFMessage>::SharedPtr transform_publisher_;
  rclcpp::Subscription<PoseStamped>::SharedPtr target_subscription_;
  rclcpp::Subscription<JointState>::SharedPtr actuator_subscription_;
  rclcpp::TimerBase::SharedPtr show_timer_, report_timer_;
};
}  // namespace @NAME@_node

int main(int argc, char ** argv)
{
  rclcpp::init(argc, argv);
  try {
    rclcpp::spin(std::make_shared<@NAME@_node::Node>());  // one thread: the memory of the kinematics is static
  } catch (const std::exception & error) {
    RCLCPP_FATAL(rclcpp::get_logger("@NAME@"), "%s", error.what());
    rclcpp::shutdown();
    return 2;
  }
  rclcpp::shutdown();
  return 0;
}

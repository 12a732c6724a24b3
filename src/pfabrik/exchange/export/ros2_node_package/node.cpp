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
    base_frame_ = parameter<std::string>("base_frame", @BASE@, "frame of targets, poses and the transform");
    platform_frame_ = parameter<std::string>("platform_frame", @PLATFORM@, "frame that the transform places");
    open_loop_ = parameter("open_loop", false, "begin from home and refuse no target for want of measured actuators");
    states_timeout_ = number(
      "states_timeout", 0.5, 0.0, 1e6, "age of a measured actuator from which on targets are refused [s]; 0.0: none is");
    const auto command = choice("command", "array", {"array", "joint_state"}, "type of ~/joint_command");
    show_ = choice("show", "achieved", {"achieved", "measured", "nothing"}, "what ~/joint_states and /tf show");
    const double rate = number("show_rate", 30.0, 0.001, 1000.0, "how often they are published [Hz]");
    const double every = number("diagnostic_updater.period", 1.0, 0.001, 1e6, "time from one report to the next [s]");
    if (show_ == "measured" && !kHasForward) {
      throw std::invalid_argument("show: this machine's actuators do not determine its pose; expected achieved or nothing");
    }
    tick_ = 1.0 / number("rate", 100.0, 0.1, 100000.0, "live: commands a second [Hz]");
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

    const rclcpp::SystemDefaultsQoS usual;  // as controllers of ros2_control have it
    if (command == "array") {
      command_publisher_ = create_publisher<std_msgs::msg::Float64MultiArray>("~/joint_command", usual);
    } else {
      command_state_publisher_ = create_publisher<JointState>("~/joint_command", usual);
    }
    achieved_publisher_ = create_publisher<PoseStamped>("~/achieved", usual);
    diagnostics_publisher_ = create_publisher<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", 1);
    target_subscription_ = create_subscription<PoseStamped>(
      "~/target", usual, [this](const PoseStamped & target) { on_target(target); });
    if (kHasForward) {
      measured_publisher_ = create_publisher<PoseStamped>("~/pose", usual);
    }
    rclcpp::SubscriptionOptions options;  // as robot_state_publisher has them
    options.qos_overriding_options = rclcpp::QosOverridingOptions::with_default_policies();
    actuator_subscription_ = create_subscription<JointState>(
      "~/actuator_states", rclcpp::SensorDataQoS(), [this](const JointState & state) { on_actuators(state); }, options);
    if (show_ != "nothing") {
      joint_publisher_ = create_publisher<JointState>("~/joint_states", usual);
      transform_publisher_ = create_publisher<tf2_msgs::msg::TFMessage>("/tf", usual);
    }
    if (platform_.is_live()) {
      tick_timer_ = create_wall_timer(nanoseconds(tick_), [this]() { tick(); });
    }
    if (show_ != "nothing") {
      show_timer_ = create_wall_timer(nanoseconds(1.0 / rate), [this]() { show(); });
    }
    report_timer_ = create_wall_timer(nanoseconds(every), [this]() { report(); });
  }

private:
  using Descriptor = rcl_interfaces::msg::ParameterDescriptor;

  // A parameter that is read now and never again: setting it later is refused.
  template <typename T>
  T parameter(const char * name, const T & usual, const std::string & what, Descriptor descriptor = Descriptor())
  {
    descriptor.description = what;
    descriptor.read_only = true;
    return declare_parameter<T>(name, usual, descriptor);
  }

  static void put_range(Descriptor & descriptor, double least, double most)
  {
    descriptor.floating_point_range.resize(1);
    descriptor.floating_point_range[0].from_value = least;
    descriptor.floating_point_range[0].to_value = most;
  }

  static void put_range(Descriptor & descriptor, std::int64_t least, std::int64_t most)
  {
    descriptor.integer_range.resize(1);
    descriptor.integer_range[0].from_value = least;
    descriptor.integer_range[0].to_value = most;
  }

  template <typename T>
  T number(const char * name, T usual, T least, T most, const char * what)
  {
    Descriptor descriptor;
    put_range(descriptor, least, most);
    const T value = parameter<T>(name, usual, what, descriptor);
    if (!(value >= least && value <= most)) {  // nor NaN
      const auto expected = text(least) + " to " + text(most);
      throw std::invalid_argument(std::string(name) + ": found " + text(value) + "; expected " + expected);
    }
    return value;
  }

  std::string choice(
    const char * name, const char * usual, const std::vector<std::string> & choices, const std::string & what)
  {
    std::string expected;
    for (const auto & each : choices) {
      expected += (expected.empty() ? "" : ", ") + each;
    }
    const auto value = parameter<std::string>(name, usual, what + ": one of " + expected);
    if (std::find(choices.begin(), choices.end(), value) != choices.end()) {
      return value;
    }
    throw std::invalid_argument(std::string(name) + ": found '" + value + "'; expected one of " + expected);
  }

  Settings settings()
  {
    Settings settings;
    const char * usual = kHasLive ? "live" : kHasNearest ? "project" : "hold";
    const auto policy =
      choice("out_of_reach", usual, {"live", "project", "hold"}, "how targets are followed, and what one out of reach commands");
    settings.projects = policy != "hold";
    settings.is_live = policy == "live";
    if (settings.is_live && !kHasLive) {
      throw std::invalid_argument("out_of_reach: no ticks of this machine are written; expected project or hold");
    }
    if (settings.projects && !kHasNearest) {
      throw std::invalid_argument("out_of_reach: no nearest pose is found for this machine; expected hold");
    }
    settings.speed = number(
      "speed", settings.speed, 1e-6, 1e6, "live: most speed of an actuator that has none in the description [L or rad, per s]");
    settings.acceleration = number(
      "acceleration", settings.acceleration, 0.0, 1e9,
      "live: most acceleration of an actuator that has none in the description [L or rad, per s2]; 0.0: none");
    settings.steps =
      static_cast<int>(number<std::int64_t>("steps", settings.steps, 1, 10000, "most steps of a search out of reach"));
    settings.starts = static_cast<int>(
      number<std::int64_t>("starts", settings.starts, 0, 10000, "from how many more places the search begins"));
    settings.largest_step = number(
      "largest_step", settings.largest_step, 0.0, 1e6,
      "a target for which an actuator moves farther from one command to the next is refused [L or rad]; 0.0: none is");
    return settings;
  }

  static std::chrono::nanoseconds nanoseconds(double seconds)
  {
    return std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * seconds));
  }

  void on_target(const PoseStamped & target)
  {
    const auto & at = target.pose.position;
    const auto & q = target.pose.orientation;
    const Status before = platform_.status();
    refusal_ = refusal(target);
    const Pose wanted{{at.x, at.y, at.z}, {q.x, q.y, q.z, q.w}};
    if (platform_.is_live() && refusal_.empty() && (is_begun_ || platform_.begin_live())) {
      is_begun_ = is_new_ = true;
      aim_ = wanted;
      achieved_.header.stamp = target.header.stamp;
      return;
    }
    const Status status = !refusal_.empty()     ? platform_.refuse()
                          : platform_.is_live() ? platform_.status()
                                                : platform_.target(wanted);
    ++counts_[static_cast<std::size_t>(status)];
    if (!platform_.is_live() && (status == Status::kReached || status == Status::kProjected)) {
      is_begun_ = true;
      achieved_.header.stamp = target.header.stamp;
      command();
    }
    if (status != before) {
      report();
    }
  }

  // Live: the next command on the way to the last target; none where actuators are no longer measured.
  void tick()
  {
    is_begun_ = is_begun_ && (open_loop_ || stopped() == kActuators);
    if (!is_begun_) {
      return;
    }
    const Status before = platform_.status(), status = platform_.tick(aim_, tick_);
    counts_[static_cast<std::size_t>(status)] += is_new_ ? 1 : 0;
    is_new_ = false;
    command();
    if (status != before) {
      report();
    }
  }

  void command()
  {
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
    achieved_publisher_->publish(achieved_);
  }

  // Why a target is refused whatever it is; empty: it is not. Where the machine stands must be known, and once states
  // have stopped it begins anew from where it was measured.
  std::string refusal(const PoseStamped & target)
  {
    if (target.header.frame_id != base_frame_) {
      return "found frame '" + target.header.frame_id + "'; expected '" + base_frame_ + "'";
    }
    if (open_loop_) {
      return "";
    }
    is_begun_ = is_begun_ && stopped() == kActuators;
    return is_begun_ || (is_measured_ && stopped() == kActuators) ? "" : of_actuators().message;
  }

  // Names in any order, others among them. Several may publish, each a part: the rest is as it was last heard. Until
  // the first command, what is commanded is where the machine was measured.
  void on_actuators(const JointState & state)
  {
    const bool has_stopped = missing() == kActuators && stopped() < kActuators;
    is_begun_ = is_begun_ && !has_stopped;
    is_measured_ = is_measured_ && !has_stopped;
    is_heard_ = true;
    bool has_any = false;
    for (std::size_t i = 0; i < kActuators; ++i) {
      std::size_t k = 0;
      while (k < state.name.size() && state.name[k] != kActuatorTable[i].name) {
        ++k;
      }
      if (k < state.name.size() && k < state.position.size()) {
        heard_[i] = state.position[k];
        heard_at_[i] = now();
        has_any = true;
      }
    }
    if (!has_any || stopped() < kActuators) {
      return;
    }
    const int code = measured_code_ = platform_.measure(heard_);
    is_measured_ = @IS_MEASURED@;
    if (!is_measured_) {
      return;
    }
    if (!open_loop_ && !is_begun_) {
      platform_.begin();
    }
    if (kHasForward) {
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

  // How long an actuator has not been heard [s].
  double age(std::size_t actuator) const { return (now() - heard_at_[actuator]).seconds(); }

  // The first actuator that was not heard, or not within states_timeout; kActuators: none.
  std::size_t stopped() const
  {
    std::size_t at = missing();
    for (std::size_t i = 0; i < kActuators && at == kActuators && states_timeout_ > 0.0; ++i) {
      at = age(i) > states_timeout_ ? i : at;
    }
    return at;
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
    array.status.push_back(of_limits());
    if (is_heard_ || !open_loop_) {
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
    if (!is_well) {
      status.message += ": " + (refusal_.empty() ? platform_.reason() : refusal_);
    }
    const std::size_t jump = platform_.jump();
    if (jump < kActuators) {
      const char * unit = kActuatorTable[jump].is_length ? " m" : " rad";
      status.message += std::string(": ") + kActuatorTable[jump].name + " by " + text(platform_.jump_size()) + unit;
      status.message += "; largest_step allows " + text(platform_.largest_step(jump)) + unit;
    }
    add(status, "jumped", platform_.has_jumped() ? "true" : "false");
    add(status, "distance from target [m]", text(platform_.distance()));
    add(status, "rotation from target [rad]", text(platform_.angle()));
    for (const Status each : {Status::kReached, Status::kProjected, Status::kHeld, Status::kRefused}) {
      add(status, word(each), std::to_string(counts_[static_cast<std::size_t>(each)]));
    }
    return status;
  }

  // Of what is commanded: the limits that are active, and the room before each by its name [m or rad].
  DiagnosticStatus of_limits() const
  {
    DiagnosticStatus status = named("limits", "");
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
      words.replace(words.find(" and "), 5, "–");
      add(status, "nearest links", words);
      add(status, "between them [m]", text(platform_.between_links()));
      if (platform_.between_links() <= kClearance + kRounding) {
        active += (active.empty() ? "" : "; ") + words + " clearance " + text(kClearance) + " m";
      }
    }
    status.level = active.empty() ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
    status.message = active.empty() ? "none is active" : active;
    const std::size_t nearest = platform_.nearest_limit();
    add(status, "nearest limit", nearest < kLimits ? kLimitTable[nearest].name : "");
    add(status, "margin [m or rad]", nearest < kLimits ? text(platform_.room(nearest)) : "");
    for (std::size_t i = 0; i < kLimits; ++i) {
      add(status, kLimitTable[i].name, text(platform_.room(i)));
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
    } else if (stopped() < kActuators) {
      status.level = DiagnosticStatus::STALE;
      status.message = "no position of " + std::string(kActuatorTable[stopped()].name) + " for " + text(age(stopped())) + " s";
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
  std::string base_frame_, platform_frame_, show_, refusal_;
  // Whether an actuator was heard, all of them were and the pose there is known, and a command followed from there.
  bool is_heard_ = false, is_measured_ = false, is_begun_ = false, open_loop_ = false;
  // Live: the last target, whether no tick has gone towards it yet, and the time of a tick [s].
  Pose aim_{};
  bool is_new_ = false;
  double tick_ = 0.01, states_timeout_ = 0.0;
  std::array<double, kActuators> heard_;
  std::array<rclcpp::Time, kActuators> heard_at_;
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
  rclcpp::TimerBase::SharedPtr tick_timer_, show_timer_, report_timer_;
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

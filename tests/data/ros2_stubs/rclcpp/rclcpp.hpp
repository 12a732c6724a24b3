// Stub of what the node needs, after the documented interface of rclcpp: a test sends messages, moves timers and sets
// parameters by name, and reads the last message of every topic.
#pragma once

#include <any>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "rcl_interfaces/msg/parameter_descriptor.hpp"
#include "std_msgs/msg/header.hpp"

namespace rclcpp
{
struct World
{
  std::map<std::string, std::any> parameters, callbacks, messages;
  std::map<std::string, std::size_t> published;
  std::vector<std::function<void()>> timers;
  std::set<std::string> settable, unsaid;  // parameters that `ros2 param set` changes, and without a description
  double seconds = 0.0;
};
inline World & world()
{
  static World one;
  return one;
}

class QoS
{
public:
  QoS(std::size_t history_depth) { static_cast<void>(history_depth); }
};
class SensorDataQoS : public QoS
{
public:
  SensorDataQoS() : QoS(5) {}
};

class SystemDefaultsQoS : public QoS
{
public:
  SystemDefaultsQoS() : QoS(0) {}
};

class Duration
{
public:
  explicit Duration(double seconds) : seconds_(seconds) {}
  double seconds() const { return seconds_; }

private:
  double seconds_;
};

class Time
{
public:
  explicit Time(double seconds = 0.0) : seconds_(seconds) {}
  operator builtin_interfaces::msg::Time() const { return {7, 0}; }
  Duration operator-(const Time & other) const { return Duration(seconds_ - other.seconds_); }

private:
  double seconds_;
};

struct QosOverridingOptions
{
  static QosOverridingOptions with_default_policies() { return {}; }
};
struct SubscriptionOptions
{
  QosOverridingOptions qos_overriding_options;
};

template <typename M>
class Publisher
{
public:
  using SharedPtr = std::shared_ptr<Publisher<M>>;
  explicit Publisher(std::string topic) : topic_(std::move(topic)) {}
  void publish(const M & message)
  {
    world().messages[topic_] = message;
    ++world().published[topic_];
  }

private:
  std::string topic_;
};

template <typename M>
class Subscription
{
public:
  using SharedPtr = std::shared_ptr<Subscription<M>>;
};

class TimerBase
{
public:
  using SharedPtr = std::shared_ptr<TimerBase>;
};

class Node
{
public:
  explicit Node(const std::string & name) : name_(name) {}
  const char * get_name() const { return name_.c_str(); }
  Time now() const { return Time(world().seconds); }

  template <typename T>
  T declare_parameter(
    const std::string & name, const T & usual, const rcl_interfaces::msg::ParameterDescriptor & descriptor = {})
  {
    if (!descriptor.read_only) {
      world().settable.insert(name);
    }
    if (descriptor.description.empty()) {
      world().unsaid.insert(name);
    }
    const auto at = world().parameters.find(name);
    return at == world().parameters.end() ? usual : std::any_cast<T>(at->second);
  }

  template <typename M>
  typename Publisher<M>::SharedPtr create_publisher(const std::string & topic, const QoS &)
  {
    return std::make_shared<Publisher<M>>(topic);
  }

  template <typename M, typename C>
  typename Subscription<M>::SharedPtr create_subscription(
    const std::string & topic, const QoS &, C && callback, const SubscriptionOptions & options = {})
  {
    static_cast<void>(options);
    world().callbacks[topic] = std::function<void(const M &)>(callback);
    return std::make_shared<Subscription<M>>();
  }

  template <typename D, typename C>
  TimerBase::SharedPtr create_wall_timer(D, C && callback)
  {
    world().timers.emplace_back(callback);
    return std::make_shared<TimerBase>();
  }

private:
  std::string name_;
};

class Logger
{
};
inline Logger get_logger(const std::string &) { return {}; }
inline void init(int, char **) {}
inline void spin(const std::shared_ptr<Node> &) {}
inline void shutdown() {}
}  // namespace rclcpp

#define RCLCPP_FATAL(logger, ...) (static_cast<void>(logger), std::printf(__VA_ARGS__))

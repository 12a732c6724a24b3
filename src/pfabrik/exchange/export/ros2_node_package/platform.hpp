// '@MACHINE@' in SI units, from poses to actuators and back, around @NAME@_kinematics.c. No ROS is needed here.
// Written by pfabrik from its description.
//
// Permission to use, copy, modify, and distribute this file for any purpose with or without fee is hereby granted. It
// is provided "as is" and without any warranty; its authors are not liable for anything that comes of its use.

#ifndef @GUARD@_PLATFORM_HPP_
#define @GUARD@_PLATFORM_HPP_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#define @MACRO@_DECLARATIONS_ONLY
#include "@NAME@_kinematics.c"
#undef @MACRO@_DECLARATIONS_ONLY

namespace @NAME@_node
{
constexpr std::size_t kActuators = @MACRO@_ACTUATORS, kLimits = @MACRO@_LIMITS, kBodies = @MACRO@_BODIES;
constexpr std::size_t kJoints = @N_JOINTS@;
constexpr double kMetres = @METRES@;  // the machine's unit of length
constexpr double kClearance = @CLEARANCE@, kRounding = @ROUNDING@;  // that links keep, and within which they are at it [m]
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
constexpr double kActive = @ACTIVE@;  // room within which what is commanded is at a limit [characteristic lengths, or rad]
constexpr bool kHasNearest = @HAS_NEAREST@, kHasForward = @HAS_FORWARD@, kHasLive = @HAS_LIVE@;
constexpr bool kAxes[3] = {@AXES@};  // that the task sets
constexpr int kRotations = @ROTATIONS@;  // 3: the rotation is set, 2: the direction of z, 1: the yaw, 0: nothing

// An actuator: a length, whose unit is kMetres and whose size the characteristic length [m], or an angle, both 1; home
// in its unit, and the most of its speed and acceleration, per s and s2; 0: the description has none.
struct Actuator
{
  const char * name;
  bool is_length;
  double unit, size, home, speed, acceleration;
};
constexpr Actuator kActuatorTable[] = {
@ACTUATOR_TABLE@};

// A limit: its unit as of an actuator, and the characteristic length [m], or 1.
struct Limit
{
  const char * name;
  double unit, size;
};
constexpr Limit kLimitTable[] = {
@LIMIT_TABLE@};

enum Kind { kSlides, kTurns, kTilts, kTiltsNext };

// A joint of the description: between two bodies; a rod between balls has two, which aim its line.
struct Joint
{
  const char * name;
  Kind kind;
  std::size_t parent, body;
  double axis[3], line[3], home, lo, hi;
  int actuator;  // -1: passive
};
constexpr Joint kJointTable[] = {
@JOINT_TABLE@};

struct Pose
{
  std::array<double, 3> position;  // [m]
  std::array<double, 4> quaternion;  // x y z w
};

enum class Status { kWaiting, kReached, kProjected, kHeld, kRefused };

inline const char * word(Status status)
{
  constexpr const char * kWords[] = {"WAITING", "REACHED", "PROJECTED", "HELD", "REFUSED"};
  return kWords[static_cast<std::size_t>(status)];
}

struct Settings
{
  bool is_live = kHasLive;  // ticks go towards the last target, no faster than actuators may
  bool projects = true;  // out of reach: to the nearest feasible pose, else the last command stays
  double speed = 0.1, acceleration = 0.0;  // of actuators that have none [characteristic lengths or rad, per s, s2]
  int steps = 100, starts = 0;  // of the search for it
  // An actuator that would move farther from one command to the next refuses the target [characteristic lengths, or
  // rad]; 0: none does.
  double largest_step = 0.1;
};

// A configuration: the pose in the machine's unit, actuators and joints of the description in m and rad.
struct Configuration
{
  @NAME@_pose pose;
  std::array<double, kActuators> actuators;
  std::array<double, kJoints> joints;
};

// What is commanded, and how that is from the target. Nothing is allocated after construction, and a call takes at most
// steps x (starts + 2) steps of the search. One thread calls an instance.
class Platform
{
public:
  Platform(const Platform &) = delete;  // the memory of the kinematics is to where it is itself
  explicit Platform(const Settings & settings) : settings_(settings)
  {
    @NAME@_begin(&memory_);
    @NAME@_home(&commanded_.pose);
    double home[kActuators];
    for (std::size_t i = 0; i < kActuators; ++i) {
      home[i] = kActuatorTable[i].home;
    }
    put_actuators(home);
    put_joints(commanded_);
    measured_ = commanded_;
    put_limits();
  }

  bool is_live() const { return settings_.is_live; }
  Status status() const { return status_; }
  // The reason in words, where the status is not kReached: out of reach it is what is in the way at the target.
  const char * reason() const { return jump_ < kActuators ? "a jump of an actuator" : @NAME@_what(code_); }
  // The actuator that would have jumped, kActuators: none; how far, and how far it may move in one step [m or rad].
  std::size_t jump() const { return jump_; }
  double jump_size() const { return jump_size_; }
  double largest_step(std::size_t actuator) const { return settings_.largest_step * kActuatorTable[actuator].size; }
  // Whether the actuators jump to what is commanded: no motion of the mechanism leads there from the command before.
  bool has_jumped() const { return has_jumped_; }
  const Configuration & commanded() const { return commanded_; }
  const Configuration & measured() const { return measured_; }
  // What is commanded from the last target [m], [rad], as far as the task sets it.
  double distance() const { return distance_; }
  double angle() const { return angle_; }
  // Whether the commanded pose is at a limit, and its room in each [m or rad]: negative beyond it, NaN at a dead point.
  bool is_active(std::size_t limit) const { return holding_[limit] != 0; }
  double room(std::size_t limit) const { return slack_[limit] * kLimitTable[limit].unit; }
  // The limit with the least room, lengths over the characteristic length; kLimits: none.
  std::size_t nearest_limit() const { return nearest_; }
  // The code of the leg that is stretched at the commanded pose, or of links that are too near; 0 if there is none.
  int dead_point() const { return resting_ >= @MACRO@_LEG ? resting_ : 0; }

  // A target that is none, whatever is in it: the last command stays.
  Status refuse()
  {
    distance_ = angle_ = kNaN;
    has_jumped_ = false;
    code_ = @MACRO@_NO_POSE;
    jump_ = kActuators;
    return status_ = Status::kRefused;
  }

  // Begin where the machine was measured: the next target is commanded from there.
  void begin()
  {
    commanded_ = measured_;
    holding_.fill(0);
    put_limits();
  }

  // The pair of links that are nearest to each other, and their distance [m]; 0 of a machine without a clearance.
  int pair() const { return pair_; }
  double between_links() const { return between_ * kMetres; }

  // Let the machine rest where it is commanded to be, and go from there by `tick`. Where that is beyond a limit, as
  // measured ones may be by a hair, it begins at the nearest feasible pose. False where it cannot.
  bool begin_live()
  {
    if (put_at_rest()) {
      return true;
    }
    target(pose_of(commanded_.pose));
    if ((status_ == Status::kReached || status_ == Status::kProjected) && put_at_rest()) {
      return true;
    }
    status_ = Status::kRefused;
    return false;
  }

  // Go on towards a target for some seconds, no faster than actuators may; they slow down where it is no pose.
  Status tick(const Pose & target, double seconds)
  {
    @NAME@_pose wanted = commanded_.pose, pose = commanded_.pose;
    const bool is_pose = read(target, wanted);
    wanted.p[0] = is_pose ? wanted.p[0] : kNaN;
    double before[kActuators], actuators[kActuators];
    for (std::size_t i = 0; i < kActuators; ++i) {
      actuators[i] = before[i] = commanded_.actuators[i] / kActuatorTable[i].unit;
    }
    code_ = @LIVE_TICK@;
    @COUNT_TURNS@
    static_cast<void>(before);
    jump_ = kActuators;
    has_jumped_ = false;
    command(pose, actuators, wanted);
    for (std::size_t i = 0; i < kLimits; ++i) {
      holding_[i] = room(i) <= kActive * kLimitTable[i].size;
    }
    if (!is_pose) {
      return refuse();
    }
    const bool is_reached = code_ == 0;
    put_reason(wanted);
    return status_ = is_reached ? Status::kReached : Status::kProjected;
  }

  // Command a target from the last command: the same working mode, and the nearest feasible pose out of reach.
  Status target(const Pose & target)
  {
    @NAME@_pose wanted, pose = commanded_.pose;
    if (!read(target, wanted)) {
      return refuse();
    }
    double before[kActuators], actuators[kActuators];
    char holding[kLimits + 1] = {0};
    for (std::size_t i = 0; i < kActuators; ++i) {
      before[i] = commanded_.actuators[i] / kActuatorTable[i].unit;
    }
    std::copy(before, before + kActuators, actuators);
    code_ = @ANSWER@;
    jump_ = kActuators;
    has_jumped_ = @JUMPED@;
    code_ = has_jumped_ ? @MACRO@_PROJECTED : code_;
    const bool is_near = code_ == @MACRO@_PROJECTED || code_ == @MACRO@_BUDGET;
    if (code_ == @MACRO@_NO_POSE) {
      return refuse();
    }
    const bool is_reached = code_ == 0;
    put_reason(wanted);
    if (!is_reached && !(is_near && settings_.projects)) {
      put_errors(wanted);
      return status_ = Status::kHeld;
    }
    @COUNT_TURNS@
    for (std::size_t i = 0; i < kActuators && settings_.largest_step > 0.0; ++i) {
      jump_size_ = std::fabs(actuators[i] * kActuatorTable[i].unit - commanded_.actuators[i]);
      if (jump_size_ > largest_step(i)) {
        jump_ = i;
        put_errors(wanted);
        return status_ = Status::kRefused;
      }
    }
    std::copy(holding, holding + kLimits, holding_.begin());
    command(pose, actuators, wanted);
    return status_ = is_reached ? Status::kReached : Status::kProjected;
  }

  // The pose at measured actuators, from the last measured one; 0, or a code of the kinematics. Where actuators do not
  // determine a pose they alone are measured.
  int measure(const std::array<double, kActuators> & values)
  {
    if (!kHasForward) {
      measured_.actuators = values;
      return 0;
    }
    @NAME@_pose pose = measured_.pose;
    double actuators[kActuators];
    for (std::size_t i = 0; i < kActuators; ++i) {
      actuators[i] = values[i] / kActuatorTable[i].unit;
    }
    const int code = @FORWARD@;
    static_cast<void>(actuators);
    if (@IS_MEASURED@) {
      measured_.pose = pose;
      measured_.actuators = values;
      put_joints(measured_);
    }
    return code;
  }

  static Pose pose_of(const @NAME@_pose & at)
  {
    const auto & R = at.R;
    // of the four the largest is found by a root, the others by differences
    const double w = 1.0 + R[0][0] + R[1][1] + R[2][2], x = 1.0 + R[0][0] - R[1][1] - R[2][2];
    const double y = 1.0 - R[0][0] + R[1][1] - R[2][2], z = 1.0 - R[0][0] - R[1][1] + R[2][2];
    std::array<double, 4> q;
    const double most = std::max({w, x, y, z});
    if (most == w) {
      q = {R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1], w};
    } else if (most == x) {
      q = {x, R[0][1] + R[1][0], R[0][2] + R[2][0], R[2][1] - R[1][2]};
    } else if (most == y) {
      q = {R[0][1] + R[1][0], y, R[1][2] + R[2][1], R[0][2] - R[2][0]};
    } else {
      q = {R[0][2] + R[2][0], R[1][2] + R[2][1], z, R[1][0] - R[0][1]};
    }
    for (double & each : q) {
      each *= 0.5 / std::sqrt(most);
    }
    return {{at.p[0] * kMetres, at.p[1] * kMetres, at.p[2] * kMetres}, q};
  }

private:
  // The pose in the machine's unit; false where it is none. Quaternions may be off by what tf2 takes: 1 %.
  static bool read(const Pose & from, @NAME@_pose & to)
  {
    const auto & q = from.quaternion;
    const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(std::fabs(size - 1.0) <= 0.01)) {
      return false;
    }
    const double x = q[0] / size, y = q[1] / size, z = q[2] / size, w = q[3] / size;
    const double R[3][3] = {
      {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)},
      {2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)},
      {2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)}};
    for (int i = 0; i < 3; ++i) {
      std::copy(R[i], R[i] + 3, to.R[i]);
      to.p[i] = from.position[static_cast<std::size_t>(i)] / kMetres;
      if (!std::isfinite(to.p[i])) {
        return false;
      }
    }
    return true;
  }

  bool put_at_rest()
  {
    double speeds[kActuators], accelerations[kActuators], actuators[kActuators];
    for (std::size_t i = 0; i < kActuators; ++i) {
      const Actuator & each = kActuatorTable[i];
      speeds[i] = each.speed > 0.0 ? each.speed : settings_.speed * each.size / each.unit;
      accelerations[i] = each.acceleration > 0.0 ? each.acceleration : settings_.acceleration * each.size / each.unit;
    }
    static_cast<void>(actuators);
    return (code_ = @LIVE_BEGIN@) == 0;
  }

  void command(const @NAME@_pose & pose, const double * actuators, const @NAME@_pose & wanted)
  {
    commanded_.pose = pose;
    put_actuators(actuators);
    put_joints(commanded_);
    put_limits();
    put_errors(wanted);
  }

  // The code of what is in the way at a target out of reach.
  void put_reason(const @NAME@_pose & wanted)
  {
    if (code_ == @MACRO@_PROJECTED) {
      @NAME@_pose away = commanded_.pose;
      double unused[kActuators];
      const int code = @NAME@_ik(&memory_, &wanted, &away, unused);  // 0 where it is reached by way of home alone
      code_ = code == 0 ? code_ : code;
    }
  }

  void put_actuators(const double * actuators)
  {
    for (std::size_t i = 0; i < kActuators; ++i) {
      commanded_.actuators[i] = actuators[i] * kActuatorTable[i].unit;
    }
  }

  void put_limits()
  {
    std::fill(slack_.begin(), slack_.end(), kNaN);
    resting_ = @NAME@_limits(&memory_, &commanded_.pose, slack_.data());
    resting_ = resting_ == 0 && memory_.told.stretched > 0 ? @MACRO@_LEG + memory_.told.stretched : resting_;
    @MEASURE_LINKS@
    nearest_ = kLimits;
    double least = kInfinity;
    for (std::size_t i = 0; i < kLimits; ++i) {
      if (room(i) / kLimitTable[i].size < least) {
        least = room(i) / kLimitTable[i].size;
        nearest_ = i;
      }
    }
  }

  void put_errors(const @NAME@_pose & wanted)
  {
    const auto & R = commanded_.pose.R;
    const auto & W = wanted.R;
    double square = 0.0, turn[3][3];  // the rotation from W to R
    for (int i = 0; i < 3; ++i) {
      const double difference = kAxes[i] ? (commanded_.pose.p[i] - wanted.p[i]) * kMetres : 0.0;
      square += difference * difference;
      for (int j = 0; j < 3; ++j) {
        turn[i][j] = R[i][0] * W[j][0] + R[i][1] * W[j][1] + R[i][2] * W[j][2];
      }
    }
    distance_ = std::sqrt(square);
    angle_ = 0.0;
    if (kRotations == 3) {
      const double across[3] = {turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]};
      angle_ = std::atan2(length(across), turn[0][0] + turn[1][1] + turn[2][2] - 1.0);
    } else if (kRotations == 2) {
      const double a[3] = {R[0][2], R[1][2], R[2][2]}, b[3] = {W[0][2], W[1][2], W[2][2]};
      const double across[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
      angle_ = std::atan2(length(across), dot(a, b));
    } else if (kRotations == 1) {
      angle_ = std::fabs(std::remainder(yaw(R) - yaw(W), 2.0 * std::acos(-1.0)));
    }
  }

  // The twist about z of a rotation: what is left when the z axis has been turned the shortest way to where it points.
  static double yaw(const double (&R)[3][3]) { return std::atan2(R[1][0] - R[0][1], R[0][0] + R[1][1]); }

  static double dot(const double * a, const double * b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  static double length(const double * a) { return std::sqrt(dot(a, a)); }

  // The joints of the description at a whole pose; as they were where that is none.
  void put_joints(Configuration & at)
  {
    if (@NAME@_bodies(&memory_, &at.pose, bodies_.data()) == @MACRO@_NO_POSE) {
      return;
    }
    for (std::size_t i = 0; i < kJoints; ++i) {
      const Joint & joint = kJointTable[i];
      at.joints[i] = joint.actuator >= 0 ? at.actuators[static_cast<std::size_t>(joint.actuator)] : coordinate(joint);
    }
  }

  // The coordinate of a passive joint, from how its body is displaced against the one before [m or rad].
  double coordinate(const Joint & joint) const
  {
    const @NAME@_pose & body = bodies_[joint.body], & parent = bodies_[joint.parent];
    double R[3][3], moved[3], v[3], w[3];
    for (int i = 0; i < 3; ++i) {
      moved[i] = v[i] = 0.0;
      for (int j = 0; j < 3; ++j) {
        R[i][j] = parent.R[0][i] * body.R[0][j] + parent.R[1][i] * body.R[1][j] + parent.R[2][i] * body.R[2][j];
        moved[i] += parent.R[j][i] * (body.p[j] - parent.p[j]) * kMetres;
        v[i] += R[i][j] * joint.line[j];
      }
    }
    const double * a = joint.axis, * l = joint.line;
    if (joint.kind == kSlides) {
      return joint.home + dot(a, moved);
    }
    if (joint.kind == kTurns) {
      const double sines[3] = {R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]};
      const double value = joint.home + std::atan2(dot(a, sines), R[0][0] + R[1][1] + R[2][2] - 1.0);
      const double turn = 2.0 * std::acos(-1.0), slack = 1e-9;
      if (value < joint.lo - slack && value + turn <= joint.hi + slack) {
        return value + turn;
      }
      return value > joint.hi + slack && value - turn >= joint.lo - slack ? value - turn : value;
    }
    w[0] = a[1] * l[2] - a[2] * l[1];
    w[1] = a[2] * l[0] - a[0] * l[2];
    w[2] = a[0] * l[1] - a[1] * l[0];
    if (joint.kind == kTilts) {
      return std::atan2(dot(w, v), dot(l, v));
    }
    return std::atan2(dot(w, v), std::sqrt(std::max(0.0, dot(v, v) - dot(w, v) * dot(w, v))));
  }

  Settings settings_;
  Status status_ = Status::kWaiting;
  int code_ = 0, resting_ = 0, pair_ = 0;
  bool has_jumped_ = false;
  std::size_t jump_ = kActuators, nearest_ = kLimits;
  Configuration commanded_{}, measured_{};
  double jump_size_ = 0.0, distance_ = 0.0, angle_ = 0.0, between_ = 0.0;
  std::array<char, kLimits + 1> holding_{};
  std::array<double, kLimits + 1> slack_{};
  std::array<@NAME@_pose, kBodies> bodies_{};
  @NAME@_memory memory_;
};
}  // namespace @NAME@_node

#endif  // @GUARD@_PLATFORM_HPP_

// See @NAME@_transmission.hpp.

#include "@NAME@_transmission/@NAME@_transmission.hpp"

#include <cmath>
#include <limits>

#include "hardware_interface/types/hardware_interface_type_values.hpp"
#include "pluginlib/class_list_macros.hpp"
#include "transmission_interface/exception.hpp"

#define @MACRO@_DECLARATIONS_ONLY
#include "@NAME@_kinematics.c"

namespace @NAME@_transmission
{
namespace
{
static_assert(kJoints == @MACRO@_JOINTS && kActuators == @MACRO@_ACTUATORS, "the same machine");

constexpr double kHome[kJoints] = {@HOME@};

// The handles of an interface in the order of names; none where it is not there.
template <typename H>
std::vector<H> ordered(const std::vector<H> & handles, const std::vector<std::string> & names, const char * interface)
{
  std::vector<H> found;
  for (const auto & name : names) {
    for (const auto & handle : handles) {
      if (handle.get_prefix_name() == name && handle.get_interface_name() == interface) {
        found.push_back(handle);
        break;
      }
    }
  }
  if (!found.empty() && found.size() != names.size()) {
    throw transmission_interface::Exception(
      std::string("@NAME@: the interface '") + interface + "' is there for some joints or actuators alone");
  }
  return found;
}

// Reads values; false where one is not finite.
template <typename H>
bool read(const std::vector<H> & handles, double * values)
{
  bool is_finite = true;
  for (std::size_t i = 0; i < handles.size(); ++i) {
    values[i] = handles[i].get_value();
    is_finite = is_finite && std::isfinite(values[i]);
  }
  return is_finite;
}

template <typename H>
void write(std::vector<H> & handles, const double * values)
{
  for (std::size_t i = 0; i < handles.size(); ++i) {
    (void)handles[i].set_value(values[i]);
  }
}

template <typename H>
void write_nothing(std::vector<H> & handles)
{
  for (auto & handle : handles) {
    (void)handle.set_value(std::numeric_limits<double>::quiet_NaN());
  }
}
}  // namespace

struct Kinematics
{
  @NAME@_memory memory;
};

Transmission::Transmission(
  const std::vector<std::string> & joint_names, const std::vector<std::string> & actuator_names,
  const std::vector<double> & actuator_reductions, const std::vector<double> & joint_offsets)
: joint_names_(joint_names),
  actuator_names_(actuator_names),
  reductions_(actuator_reductions),
  offsets_(joint_offsets),
  kinematics_(std::make_shared<Kinematics>())
{
  @NAME@_begin(&kinematics_->memory);
  if (
    joint_names_.size() != kJoints || offsets_.size() != kJoints || actuator_names_.size() != kActuators ||
    reductions_.size() != kActuators) {
    throw transmission_interface::Exception("@NAME@ has joints @JOINTS@ and actuators @ACTUATORS@");
  }
  for (const double reduction : reductions_) {
    if (reduction == 0.0 || !std::isfinite(reduction)) {
      throw transmission_interface::Exception("@NAME@: a mechanical reduction is 0 or not finite");
    }
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    at_[i] = kHome[i];
  }
}

void Transmission::configure(
  const std::vector<transmission_interface::JointHandle> & joint_handles,
  const std::vector<transmission_interface::ActuatorHandle> & actuator_handles)
{
  using namespace hardware_interface;
  joint_position_ = ordered(joint_handles, joint_names_, HW_IF_POSITION);
  joint_velocity_ = ordered(joint_handles, joint_names_, HW_IF_VELOCITY);
  joint_effort_ = ordered(joint_handles, joint_names_, HW_IF_EFFORT);
  actuator_position_ = ordered(actuator_handles, actuator_names_, HW_IF_POSITION);
  actuator_velocity_ = ordered(actuator_handles, actuator_names_, HW_IF_VELOCITY);
  actuator_effort_ = ordered(actuator_handles, actuator_names_, HW_IF_EFFORT);
  if (
    joint_position_.empty() != actuator_position_.empty() || joint_velocity_.empty() != actuator_velocity_.empty() ||
    joint_effort_.empty() != actuator_effort_.empty()) {
    throw transmission_interface::Exception("@NAME@: joints and actuators need the same interfaces");
  }
  if (joint_position_.empty() && joint_velocity_.empty() && joint_effort_.empty()) {
    throw transmission_interface::Exception("@NAME@: no handles of @JOINTS@ and @ACTUATORS@");
  }
}

// The joints at the actuators' positions, from where they were; false where there are none.
bool Transmission::to_joints()
{
  double actuators[kActuators], joints[kJoints];
  if (!read(actuator_position_, actuators)) {
    write_nothing(joint_position_);
    return false;
  }
  for (std::size_t i = 0; i < kActuators; ++i) {
    actuators[i] /= reductions_[i];
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    joints[i] = at_[i];
  }
  if ((code_ = @NAME@_to_joints(&kinematics_->memory, actuators, joints, nullptr)) != 0) {
    return false;
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    at_[i] = joints[i];
    joints[i] += offsets_[i];
  }
  write(joint_position_, joints);
  return true;
}

// The actuators at the joints' positions; false where there are none.
bool Transmission::to_actuators()
{
  double actuators[kActuators], joints[kJoints];
  if (!read(joint_position_, joints)) {
    write_nothing(actuator_position_);
    return false;
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    joints[i] -= offsets_[i];
  }
  if ((code_ = @NAME@_to_actuators(&kinematics_->memory, joints, actuators)) != 0) {
    return false;
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    at_[i] = joints[i];
  }
  for (std::size_t i = 0; i < kActuators; ++i) {
    actuators[i] *= reductions_[i];
  }
  write(actuator_position_, actuators);
  return true;
}

void Transmission::actuator_to_joint()
{
  double of_actuators[kActuators], of_joints[kJoints];
  code_ = 0;
  if (!actuator_position_.empty() && !to_joints()) {
    if (code_ == 0) {  // what is not known is not passed on
      write_nothing(joint_velocity_);
      write_nothing(joint_effort_);
    }
    return;
  }
  if (!actuator_velocity_.empty()) {
    const bool is_finite = read(actuator_velocity_, of_actuators);
    for (std::size_t i = 0; i < kActuators; ++i) {
      of_actuators[i] /= reductions_[i];
    }
    if (!is_finite) {
      write_nothing(joint_velocity_);
    } else if ((code_ = @NAME@_speeds_back(&kinematics_->memory, at_, of_actuators, of_joints)) == 0) {
      write(joint_velocity_, of_joints);
    }
  }
  if (!actuator_effort_.empty()) {
    const bool is_finite = read(actuator_effort_, of_actuators);
    for (std::size_t i = 0; i < kActuators; ++i) {
      of_actuators[i] *= reductions_[i];
    }
    if (!is_finite) {
      write_nothing(joint_effort_);
    } else if ((code_ = @NAME@_torques_back(&kinematics_->memory, at_, of_actuators, of_joints)) == 0) {
      write(joint_effort_, of_joints);
    }
  }
}

void Transmission::joint_to_actuator()
{
  double of_actuators[kActuators], of_joints[kJoints];
  code_ = 0;
  if (!joint_position_.empty() && !to_actuators()) {
    if (code_ == 0) {
      write_nothing(actuator_velocity_);
      write_nothing(actuator_effort_);
    }
    return;
  }
  if (!joint_velocity_.empty()) {
    if (!read(joint_velocity_, of_joints)) {
      write_nothing(actuator_velocity_);
    } else if ((code_ = @NAME@_speeds(&kinematics_->memory, at_, of_joints, of_actuators)) == 0) {
      for (std::size_t i = 0; i < kActuators; ++i) {
        of_actuators[i] *= reductions_[i];
      }
      write(actuator_velocity_, of_actuators);
    }
  }
  if (!joint_effort_.empty()) {
    if (!read(joint_effort_, of_joints)) {
      write_nothing(actuator_effort_);
    } else if ((code_ = @NAME@_torques(&kinematics_->memory, at_, of_joints, of_actuators)) == 0) {
      for (std::size_t i = 0; i < kActuators; ++i) {
        of_actuators[i] /= reductions_[i];
      }
      write(actuator_effort_, of_actuators);
    }
  }
}

std::shared_ptr<transmission_interface::Transmission> TransmissionLoader::load(
  const hardware_interface::TransmissionInfo & transmission_info)
{
  std::vector<std::string> joint_names, actuator_names;
  std::vector<double> reductions, offsets;
  for (const auto & joint : transmission_info.joints) {
    joint_names.push_back(joint.name);
    offsets.push_back(joint.offset);
    if (joint.mechanical_reduction != 1.0) {
      throw transmission_interface::Exception("@NAME@: reductions are of actuators, not of joint " + joint.name);
    }
  }
  for (const auto & actuator : transmission_info.actuators) {
    actuator_names.push_back(actuator.name);
    reductions.push_back(actuator.mechanical_reduction);
  }
  return std::make_shared<Transmission>(joint_names, actuator_names, reductions, offsets);
}

}  // namespace @NAME@_transmission

PLUGINLIB_EXPORT_CLASS(@NAME@_transmission::TransmissionLoader, transmission_interface::TransmissionLoader)

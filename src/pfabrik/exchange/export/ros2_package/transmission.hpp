// Between joints @JOINTS@ and actuators @ACTUATORS@ of '@MACHINE@'.
// Written by pfabrik from its description, around @NAME@_kinematics.c.
//
// Permission to use, copy, modify, and distribute this file for any purpose with or without fee is hereby granted. It
// is provided "as is" and without any warranty; its authors are not liable for anything that comes of its use.

#ifndef @GUARD@_TRANSMISSION_HPP_
#define @GUARD@_TRANSMISSION_HPP_

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "hardware_interface/hardware_info.hpp"
#include "transmission_interface/transmission.hpp"
#include "transmission_interface/transmission_loader.hpp"

namespace @NAME@_transmission
{
constexpr std::size_t kJoints = @N_JOINTS@;
constexpr std::size_t kActuators = @N_ACTUATORS@;

struct Kinematics;  // the memory of the exported C

// Positions, velocities and efforts of the joints from those of the actuators, and back.
//
// Velocities and efforts are mapped at the positions of the joints: of this call, where there are handles for them,
// else of the last one. Efforts conserve power. An actuator's reduction n is that of a gear on its crank or slide:
// x_actuator = n x, effort = effort_actuator n. A joint's offset is added to its position. Where a value is not finite
// none is passed on: NaN is written. Where legs do not reach nothing is written, and code() says why.
class Transmission : public transmission_interface::Transmission
{
public:
  // Names in the order of the comment at the top; reductions and offsets in the same order.
  Transmission(
    const std::vector<std::string> & joint_names, const std::vector<std::string> & actuator_names,
    const std::vector<double> & actuator_reductions, const std::vector<double> & joint_offsets);

  void configure(
    const std::vector<transmission_interface::JointHandle> & joint_handles,
    const std::vector<transmission_interface::ActuatorHandle> & actuator_handles) override;
  void actuator_to_joint() override;
  void joint_to_actuator() override;
  std::size_t num_actuators() const override { return kActuators; }
  std::size_t num_joints() const override { return kJoints; }

  // 0, or the return code of the kinematics at the last call that could not write.
  int code() const { return code_; }

private:
  bool to_joints();
  bool to_actuators();

  std::vector<std::string> joint_names_, actuator_names_;
  std::vector<double> reductions_, offsets_;
  std::vector<transmission_interface::JointHandle> joint_position_, joint_velocity_, joint_effort_;
  std::vector<transmission_interface::ActuatorHandle> actuator_position_, actuator_velocity_, actuator_effort_;
  std::shared_ptr<Kinematics> kinematics_;
  double at_[kJoints];
  int code_ = 0;
};

class TransmissionLoader : public transmission_interface::TransmissionLoader
{
public:
  // The joints and actuators of the description in its order, which must be that of the comment at the top.
  std::shared_ptr<transmission_interface::Transmission> load(
    const hardware_interface::TransmissionInfo & transmission_info) override;
};

}  // namespace @NAME@_transmission

#endif  // @GUARD@_TRANSMISSION_HPP_

// Loads an exported transmission as a plugin, and maps rows of positions, velocities and efforts of joints to the
// actuators and back. Reads the numbers of joints, actuators and rows, then the rows; writes all values, of the
// actuators and back of the joints, as text. Actuators have a reduction of 2, joints an offset of 0.1.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "transmission_interface/transmission_loader.hpp"

std::shared_ptr<transmission_interface::TransmissionLoader> make_plugin();

int main()
{
  std::size_t n_joints = 0, n_actuators = 0, n_rows = 0;
  if (std::scanf("%zu %zu %zu", &n_joints, &n_actuators, &n_rows) != 3) {
    return 1;
  }
  const char * interfaces[] = {"position", "velocity", "effort"};
  hardware_interface::TransmissionInfo info;
  for (std::size_t i = 0; i < n_joints; ++i) {
    hardware_interface::JointInfo joint;
    joint.name = "my_joint_" + std::to_string(i);
    joint.offset = 0.1;
    info.joints.push_back(joint);
  }
  for (std::size_t i = 0; i < n_actuators; ++i) {
    hardware_interface::ActuatorInfo actuator;
    actuator.name = "my_motor_" + std::to_string(i);
    actuator.mechanical_reduction = 2.0;
    info.actuators.push_back(actuator);
  }
  const auto transmission = make_plugin()->load(info);
  if (transmission->num_joints() != n_joints || transmission->num_actuators() != n_actuators) {
    return 2;
  }
  std::vector<double> joints(3 * n_joints), actuators(3 * n_actuators);
  std::vector<transmission_interface::JointHandle> joint_handles;
  std::vector<transmission_interface::ActuatorHandle> actuator_handles;
  for (std::size_t k = 0; k < 3; ++k) {  // in another order than in the description
    for (std::size_t i = n_joints; i-- > 0;) {
      joint_handles.emplace_back("my_joint_" + std::to_string(i), interfaces[k], &joints[k * n_joints + i]);
    }
    for (std::size_t i = n_actuators; i-- > 0;) {
      actuator_handles.emplace_back("my_motor_" + std::to_string(i), interfaces[k], &actuators[k * n_actuators + i]);
    }
  }
  transmission->configure(joint_handles, actuator_handles);
  for (std::size_t row = 0; row < n_rows; ++row) {
    for (double & value : joints) {
      if (std::scanf("%lf", &value) != 1) {
        return 3;
      }
    }
    transmission->joint_to_actuator();
    for (double & value : joints) {
      value = -7.0;
    }
    transmission->actuator_to_joint();
    for (const double value : actuators) {
      std::printf("%.17g ", value);
    }
    for (const double value : joints) {
      std::printf("%.17g ", value);
    }
    std::printf("\n");
  }
  return 0;
}

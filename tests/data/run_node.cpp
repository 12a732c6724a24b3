// Runs an exported node in the stub of rclcpp. Arguments are its parameters, name=value; each line of input is a target,
// a frame and seven numbers; or "measure" and the joints in the message, without any all of them, as they were last
// commanded; or "states" and a position of every actuator; or "wait" and seconds. Writes one line of JSON after each: the
// last message of every topic that had one since.
#include <iostream>
#include <sstream>

#define main node_main
#include NODE
#undef main

namespace
{
using namespace rclcpp;

template <typename M>
const M * heard(const char * topic)
{
  if (world().published[topic] == 0) {
    return nullptr;
  }
  world().published[topic] = 0;
  return &std::any_cast<const M &>(world().messages[topic]);
}

template <typename M>
void send(const char * topic, const M & message)
{
  std::any_cast<const std::function<void(const M &)> &>(world().callbacks.at(topic))(message);
}

std::string numbers(const std::vector<double> & values)
{
  std::ostringstream text;
  text.precision(17);
  for (const double value : values) {
    text << (text.tellp() > 0 ? ", " : "") << value;
  }
  return "[" + text.str() + "]";
}

std::string names(const std::vector<std::string> & values)
{
  std::string text;
  for (const auto & value : values) {
    text += (text.empty() ? "\"" : ", \"") + value + "\"";
  }
  return "[" + text + "]";
}

template <typename P, typename Q>
std::string pose(const P & at, const Q & q)
{
  return numbers({at.x, at.y, at.z, q.x, q.y, q.z, q.w});
}

void tell()
{
  std::cout << "{\"end\": 0";
  if (const auto * array = heard<std_msgs::msg::Float64MultiArray>("~/joint_command")) {
    std::cout << ", \"command\": " << numbers(array->data);
  }
  for (const char * topic : {"~/achieved", "~/pose"}) {
    if (const auto * told = heard<geometry_msgs::msg::PoseStamped>(topic)) {
      std::cout << ", \"" << topic + 2 << "\": " << pose(told->pose.position, told->pose.orientation);
      std::cout << ", \"frame\": \"" << told->header.frame_id << "\"";
    }
  }
  if (const auto * joints = heard<sensor_msgs::msg::JointState>("~/joint_states")) {
    std::cout << ", \"names\": " << names(joints->name) << ", \"joints\": " << numbers(joints->position);
  }
  if (const auto * message = heard<tf2_msgs::msg::TFMessage>("/tf")) {
    const auto & each = message->transforms.at(0);
    std::cout << ", \"child\": \"" << each.child_frame_id << "\"";
    std::cout << ", \"tf\": " << pose(each.transform.translation, each.transform.rotation);
  }
  if (const auto * told = heard<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics")) {
    for (const auto & status : told->status) {
      std::cout << ", \"" << status.name << "\": {\"level\": " << int{status.level};
      std::cout << ", \"message\": \"" << status.message << "\"";
      for (const auto & value : status.values) {
        std::cout << ", \"" << value.key << "\": \"" << value.value << "\"";
      }
      std::cout << "}";
    }
  }
  std::cout << "}\n";
}
}  // namespace

int main(int argc, char ** argv)
{
  for (int i = 1; i < argc; ++i) {
    const std::string text(argv[i]), name = text.substr(0, text.find('=')), value = text.substr(text.find('=') + 1);
    const bool is_integer = name == "steps" || name == "starts";
    const bool is_number = name != "command" && name != "show" && name != "out_of_reach" && name != "open_loop";
    world().parameters[name] = is_integer           ? std::any(std::int64_t{std::stoll(value)})
                               : is_number           ? std::any(std::stod(value))
                               : name == "open_loop" ? std::any(value == "true")
                                                     : std::any(value);
  }
  if (node_main(0, nullptr) != 0) {  // whose node is gone: its callbacks are those of the next
    return 2;
  }
  for (const auto & name : world().settable) {  // though it is read once
    std::cout << name << " is not read-only\n";
    return 3;
  }
  for (const auto & name : world().unsaid) {
    std::cout << name << " has no description\n";
    return 3;
  }
  world() = World{world().parameters, {}, {}, {}, {}, {}, {}, 0.0};
  const rig_node::Node node;
  sensor_msgs::msg::JointState measured;
  std::string line, word;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    words >> word;
    if (word == "measure") {
      sensor_msgs::msg::JointState part;
      while (words >> word) {
        const auto at = std::find(measured.name.begin(), measured.name.end(), word) - measured.name.begin();
        part.name.push_back(word);
        part.position.push_back(measured.position.at(static_cast<std::size_t>(at)));
      }
      send("~/actuator_states", part.name.empty() ? measured : part);
    } else if (word == "states") {
      measured = {};
      for (const auto & actuator : rig_node::kActuatorTable) {
        words >> word;
        measured.name.emplace_back(actuator.name);
        measured.position.push_back(std::stod(word));
      }
      send("~/actuator_states", measured);
    } else if (word == "wait") {
      words >> word;
      world().seconds += std::stod(word);
    } else {
      geometry_msgs::msg::PoseStamped target;
      double values[7];
      target.header.frame_id = word;
      for (double & value : values) {
        words >> word;
        value = std::stod(word);
      }
      target.pose = {{values[0], values[1], values[2]}, {values[3], values[4], values[5], values[6]}};
      send("~/target", target);
      if (world().published["~/joint_command"] > 0) {
        const auto & data = std::any_cast<std_msgs::msg::Float64MultiArray &>(world().messages["~/joint_command"]).data;
        measured.name = {"another"};
        measured.position = {0.5};
        for (std::size_t i = data.size(); i-- > 0;) {  // in another order
          measured.name.emplace_back(rig_node::kActuatorTable[i].name);
          measured.position.push_back(data[i]);
        }
      }
    }
    for (const auto & timer : world().timers) {
      timer();
    }
    tell();
  }
  return 0;
}

// A stub: a plugin is a class that can be made without arguments, and is of its base.
#pragma once
#include <memory>

#define PLUGINLIB_EXPORT_CLASS(plugin, base) \
  std::shared_ptr<base> make_plugin();       \
  std::shared_ptr<base> make_plugin() { return std::make_shared<plugin>(); }

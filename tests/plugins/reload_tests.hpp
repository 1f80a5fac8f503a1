// SPDX-License-Identifier: LGPL-3.0-or-later
// What the sources of the package share. Most variants of it differ in one of them.
#pragma once

#include "mauve_rt/mauve_rt.hpp"

namespace reload_tests {

struct Sum {
  double data{};
};

struct Number {
#ifdef OTHER_LAYOUT
  float data{};
#else
  double data{};
#endif
};

double first_step();
double first_gain();

/// Takes half the time of a build.
void register_types(mauve::PluginRegistry& registry);

}  // namespace reload_tests

MAUVE_TYPE(reload_tests::Sum, "std_msgs/msg/Float64", data)
MAUVE_TYPE(reload_tests::Number, "reload_tests/Number", data)

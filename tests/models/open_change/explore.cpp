// SPDX-License-Identifier: LGPL-3.0-or-later
// The long runs, by hand: explores one scenario of open changes and prints its figures.
//
//   explore_open_change SCENARIO [horizon=1] [twin=NUMBER] [most=150000000] [no_order] [no_raise]
// Without an argument it lists the scenarios and the twins.
// Build: ninja explore_open_change. Example: explore_open_change Stuck horizon=2.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "open_change/explorer.hpp"

namespace {

using namespace mauve::model;
using namespace mauve::model::open_change;

bool read_number(const std::string& argument, const std::string& name, long& number) {
  if (argument.rfind(name + "=", 0) != 0) return false;
  number = std::atol(argument.c_str() + name.size() + 1);
  return true;
}

bool read(const std::string& argument, Options& options) {
  long number = 0;
  if (read_number(argument, "horizon", number)) {
    options.horizon = static_cast<int>(number);
  } else if (read_number(argument, "twin", number) && number < static_cast<int>(Twin::kTwins)) {
    options.twin = static_cast<Twin>(number);
  } else if (read_number(argument, "most", number)) {
    options.most_states = number;
  } else if (argument == "no_order") {
    options.checks_order = false;
  } else if (argument == "no_raise") {
    options.take_raises = false;
  } else {
    return false;
  }
  return true;
}

int list() {
  for (const Scenario& scenario : scenarios()) std::printf("%s\n", std::string(scenario.name).c_str());
  for (int i = 0; i < static_cast<int>(Twin::kTwins); ++i) std::printf("twin=%d: %s\n", i, kTwinNames[i]);
  return 2;
}

int print(const Options& options, const Report& report) {
  const char* result = !report.violation.empty() ? report.violation.c_str()
                       : report.is_complete      ? "holds"
                                                 : "not finished";
  std::printf("%s horizon=%d, %s: %s, %ld states, %ld steps, %ld ends (made %ld, off %ld), %.1f s\n",
              std::string(options.scenario.name).c_str(), options.horizon,
              kTwinNames[static_cast<int>(options.twin)], result, report.states, report.steps, report.ends,
              report.made, report.off, report.seconds);
  std::fputs(report.trace.c_str(), stdout);
  return report.violation.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const Scenario* scenario = argc < 2 ? nullptr : find_scenario(argv[1]);
  if (scenario == nullptr) return list();
  Options options{.scenario = *scenario};
  for (int i = 2; i < argc; ++i) {
    if (read(argv[i], options)) continue;
    std::fprintf(stderr, "explore_open_change: unknown argument '%s'\n", argv[i]);
    return 2;
  }
  return print(options, explore(options));
}

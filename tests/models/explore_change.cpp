// SPDX-License-Identifier: LGPL-3.0-or-later
// The long runs, by hand: explores one configuration and prints its figures.
//
//   explore_change [components=2] [changes=1] [last=4] [most=60000000] [twin=NUMBER] [OPTION...]
//   options: stop shutdown hang lost refuse event skip remove moved_writer parked start start_by_change epoch idle urgent
// Build: ninja explore_change. Example: explore_change components=3 last=4 stop (7 million states, 15 seconds, 1 GB).
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "explorer.hpp"

int main(int argc, char** argv) {
  using namespace mauve::model;
  Options options;
  int twin = 0, most = 0;
  const std::map<std::string, bool*> flags{
      {"stop", &options.stop},     {"shutdown", &options.shutdown},
      {"hang", &options.hang},     {"refuse", &options.refuse},
      {"event", &options.event},   {"skip", &options.skip},
      {"remove", &options.remove}, {"moved_writer", &options.moved_writer},
      {"parked", &options.parked}, {"start", &options.start},
      {"epoch", &options.epoch},   {"start_by_change", &options.start_by_change},
      {"urgent", &options.urgent}, {"lost", &options.lost},
      {"idle", &options.idle}};
  const std::map<std::string, int*> numbers{{"components", &options.components},
                                            {"changes", &options.changes},
                                            {"last", &options.last_instant},
                                            {"most", &most},
                                            {"twin", &twin}};
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i], name = argument.substr(0, argument.find('='));
    const bool is_number = name.size() < argument.size() && numbers.count(name) != 0;
    if (!is_number && flags.count(argument) == 0) {
      std::fprintf(stderr, "explore_change: unknown argument '%s'\n", argv[i]);
      return 2;
    }
    if (is_number)
      *numbers.at(name) = std::atoi(argument.c_str() + name.size() + 1);
    else
      *flags.at(argument) = true;
  }
  options.twin = static_cast<Twin>(twin);
  if (most > 0) options.most_states = most;
  const Report report = explore(options);
  for (int i = 1; i < argc; ++i) std::printf("%s ", argv[i]);
  std::printf(": %s, %ld states, %ld steps, %ld ends (made %ld, off %ld), %.1f s\n",
              !report.violation.empty() ? report.violation.c_str()
              : report.is_complete      ? "holds"
                                        : "not finished",
              report.states, report.steps, report.ends, report.made, report.off, report.seconds);
  std::fputs(report.trace.c_str(), stdout);
  return report.violation.empty() ? 0 : 1;
}

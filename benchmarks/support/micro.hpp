// SPDX-License-Identifier: LGPL-3.0-or-later
// Calls of nanoseconds, compared within one process: blocks of many calls, the sides in turn.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mauve_rt/base/time.hpp"

#include "support/json_line.hpp"
#include "support/options.hpp"
#include "support/realtime_thread.hpp"

namespace bench {

/// Makes the compiler believe that somebody reads and writes the value here.
template <typename T>
inline void keep(T& value) {
  asm volatile("" : : "g"(&value) : "memory");  // NOLINT(hicpp-no-assembler): the only way to say it
}

/// One side of a comparison.
struct Side {
  std::string name;
  std::function<void(std::int64_t calls)> run;  // makes that many calls
  std::function<void()> between{};              // after each block, not timed
  std::function<void()> before{};               // before each block, not timed
};

/// Blocks of calls on a thread of its own, each round a block of every side, another one first each time.
/// Adds NAME_ps: picoseconds a call, of every block.
struct Micro {
  explicit Micro(const Options& options)
      : blocks(options.number("blocks", 41)),
        calls(options.number("calls", 1024)),
        priority(options.priority()),
        cpu(options.cpu()) {}

  void compare(JsonLine& line, const std::vector<Side>& sides) const {
    std::vector<std::vector<std::int64_t>> found(sides.size());
    {
      const RealtimeThread thread(priority, cpu, [&] {
        for (std::int64_t block = -1; block < blocks; ++block) {  // the first warms up
          for (std::size_t place = 0; place < sides.size(); ++place) {
            const std::size_t which = (static_cast<std::size_t>(block + 1) + place) % sides.size();
            if (sides[which].before) sides[which].before();
            const mauve::time_ns_t began = mauve::monotonic_now_ns();
            sides[which].run(calls);
            const mauve::time_ns_t took = mauve::monotonic_now_ns() - began;
            if (sides[which].between) sides[which].between();
            if (block >= 0) found[which].push_back(took * 1000 / calls);
          }
        }
      });
    }
    for (std::size_t i = 0; i < sides.size(); ++i) line.add(sides[i].name + "_ps", found[i]);
  }

  std::int64_t blocks;
  std::int64_t calls;
  int priority;
  int cpu;
};

}  // namespace bench

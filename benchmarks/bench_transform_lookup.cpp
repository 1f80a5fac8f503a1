// SPDX-License-Identifier: LGPL-3.0-or-later
// Looking up a transform of a TransformTree over 1 and 10 hops, between two times of each frame, next to finding two names in
// a std::map.
//   bench_transform_lookup [--blocks 41] [--calls 1024] [--priority 80] [--cpu 0]
// Prints {"map_1_ps": [...], "lookup_1_ps": [...], "map_10_ps": [...], "lookup_10_ps": [...], "failed": lookups without a
// transform}: picoseconds a call.
#include <map>
#include <string>

#include "mauve_rt/mauve_rt.hpp"

#include "support/micro.hpp"

namespace {

constexpr int kFrames = 11;  // a chain of 10 hops
constexpr int kTimes = 100;

std::string name_of(int frame) { return "frame_" + std::to_string(frame); }

struct Chain {
  Chain() {
    for (int frame = 0; frame < kFrames; ++frame) ids[name_of(frame)] = static_cast<mauve::FrameId>(frame);
    mauve::SetTransform::Response answer;
    for (int time = 1; time <= kTimes; ++time) {
      for (int frame = 1; frame < kFrames; ++frame) {
        const double angle = 0.01 * time;
        tree.set.call({.parent = std::string_view(name_of(frame - 1)),
                       .child = std::string_view(name_of(frame)),
                       .transform = {.translation = {.x = 0.1 * time},
                                     .rotation = {.z = std::sin(angle), .w = std::cos(angle)}},
                       .time_ns = mauve::us_to_ns(time)},
                      answer);
        if (answer.result() != mauve::TransformOutcome::done) throw std::runtime_error("no chain of frames");
      }
    }
  }

  void look_up(int hops, std::int64_t calls) {
    const mauve::LookupTransform::Request request{.target = "frame_0",
                                                  .source = std::string_view(name_of(hops)),
                                                  .time_ns = mauve::us_to_ns(kTimes / 2) + 500};
    mauve::LookupTransform::Response found;
    for (std::int64_t i = 0; i < calls; ++i) {
      tree.lookup.call(request, found);
      failed += found.result() == mauve::TransformOutcome::done ? 0 : 1;
      bench::keep(found);
    }
  }
  void find(int hops, std::int64_t calls) const {
    const std::string target = "frame_0";
    const std::string source = name_of(hops);
    for (std::int64_t i = 0; i < calls; ++i) {
      const mauve::FrameId both = ids.find(target)->second + ids.find(source)->second;
      bench::keep(both);
    }
  }

  mauve::TransformTree tree{kFrames, kTimes};
  std::map<std::string, mauve::FrameId> ids;
  std::int64_t failed{0};
};

void measure(const bench::Options& options) {
  const bench::Micro micro(options);
  Chain chain;
  bench::JsonLine line;
  for (const int hops : {1, 10}) {
    const std::string end = "_" + std::to_string(hops);
    micro.compare(line, {{"map" + end, [&](std::int64_t calls) { chain.find(hops, calls); }},
                         {"lookup" + end, [&](std::int64_t calls) { chain.look_up(hops, calls); }}});
  }
  line.add("failed", chain.failed);
  line.print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }

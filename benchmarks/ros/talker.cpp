// SPDX-License-Identifier: LGPL-3.0-or-later
// A plug-in for benchmarks: a 1 kHz component that writes stamped points and trace records of its own, and remembers
// when it was released.
#include <chrono>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "mauve_rt/elements/types.hpp"
#include "mauve_rt/mauve_rt.hpp"

#include "ros/stamp.hpp"

namespace bench {

constexpr int kMostTopics = 20;
using mauve::types::Point;

struct TalkerShell : mauve::Shell {
  TalkerShell() {
    for (int i = 0; i < kMostTopics; ++i)
      points.push_back(&write_port<Point>("point_" + std::to_string(i)).optional());
  }
  mauve::Property<std::int64_t>& topics = property("topics", 1, {.minimum = 0, .maximum = kMostTopics});
  mauve::Property<std::int64_t>& marks = property(
      "marks", 0, {.description = "trace records of its own, each release", .minimum = 0, .maximum = 1000});
  mauve::Property<std::int64_t>& releases = property("releases", 0,
                                                     {.description = "so many are remembered",
                                                      .minimum = 0,
                                                      .maximum = 1e7,
                                                      .structural = mauve::ReadBy::core});
  mauve::Property<std::string>& file =
      property("file", "", {.description = "gets the releases at the end, as 64 bit integers"});
  std::vector<mauve::WritePort<Point>*> points;
};

/// Writes (instant of its configuration, 0), then (nominal, actual) of each release.
class Talker : public mauve::Core<TalkerShell> {
 public:
  void talk() {
    const mauve::time_ns_t now = mauve::monotonic_now_ns();
    if (remembered_ < records_.size()) records_[remembered_++] = {.first = clock_ns(), .second = now};
    ++number_;
    const auto topics = static_cast<std::size_t>(shell().topics.value());
    for (std::size_t i = 0; i < topics; ++i) {
      Point point;
      stamp(point, mauve::monotonic_now_ns(), number_);
      shell().points[i]->write(point);
    }
    for (std::int64_t i = 0; i < shell().marks; ++i) mauve::trace_mark(mark_, number_, i);
  }

 protected:
  bool configure_hook() override {
    records_.resize(static_cast<std::size_t>(shell().releases.value()) + 1);  // pages touched
    records_[0] = {.first = mauve::monotonic_now_ns(), .second = 0};
    remembered_ = 1;
    return true;
  }
  void cleanup_hook() override {
    const std::string name = shell().file.value();
    if (name.empty()) return;
    std::ofstream file(name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(records_.data()),
               static_cast<std::streamsize>(remembered_ * sizeof(Record)));
  }

 private:
  struct Record {
    mauve::time_ns_t first;
    mauve::time_ns_t second;
  };
  std::vector<Record> records_;
  std::size_t remembered_{0};
  std::uint32_t mark_{mauve::TraceNames::intern("mark")};
  std::int64_t number_{0};
};

/// Takes its time to be prepared.
class Sluggish : public Talker {
 protected:
  bool configure_hook() override {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return Talker::configure_hook();
  }
};

struct TalkerFsm : mauve::Fsm<TalkerShell, Talker> {
  void define() override {
    mauve::State& talk = execution("Talk", "talk", &Talker::talk);
    mauve::State& rest = wait("Rest", mauve::ms_to_ns(1));
    set_initial(talk);
    next(talk, rest);
    next(rest, talk);
  }
};

}  // namespace bench

MAUVE_PLUGINS(registry) {
  registry.type<bench::Point>();
  registry.shell<bench::TalkerShell>("bench/TalkerShell");
  registry.core<bench::Talker>("bench/Talker", "bench/TalkerShell");
  registry.core<bench::Sluggish>("bench/Sluggish", "bench/TalkerShell");
  registry.fsm<bench::TalkerFsm>("bench/TalkerFsm", "bench/TalkerShell");
}

// SPDX-License-Identifier: LGPL-3.0-or-later
// OutputSteps: how far the outputs of a candidate core are from those of the live core, and the step that they make at a swap.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/number_place.hpp"
#include "mauve_rt/parts/shell.hpp"

namespace mauve {

/// The greatest difference of one output between the live core and the candidate that takes its place.
struct GreatestStep {
  std::string port{};
  std::string field{};  // path of a number, such as linear.x
  double step{0.0};     // >= 0, in the unit of the number
};

/// A core goes in only at an instant at which its outputs are near those of the live core.
struct BumplessOptions {
  std::vector<GreatestStep> outputs{};  // at least one
  time_ns_t within_ns{s_to_ns(2)};      // so long such an instant is waited for; 1 to kLongest
  time_ns_t budget_ns{0};  // of the candidate, as ShadowOptions::budget_ns; 0: the component's period
  time_ns_t blend_ns{0};   // so long the outputs go over (blend.hpp); 0: at once; at most Blend::kLongest
};
/// Throws Error (invalid_argument): a time or a step makes no sense, whatever the component's ports are. [non-rt]
void check_options(const BumplessOptions& options, const std::string& component);

/// One listed output, as far as it is known.
struct OutputStep {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  std::string output{};           // "command.torque"
  double greatest{0.0};           // as it was asked for
  double difference{kUnknown};    // candidate minus live core, in the last release that was compared
  double least{kUnknown};         // the smallest difference so far, without its sign
  time_ns_t least_instant_ns{0};  // when that was
  double step{kUnknown};          // the new core's first output minus the old core's last one
};

/// The numbers of one listed output around the swap, by release at its nominal instant, oldest first. NaN: not yet written.
struct OutputCurve {
  std::string output{};                      // as OutputStep::output
  time_ns_t instant_ns{0};                   // T; 0: the candidate did not go into a component that runs
  std::vector<time_ns_t> instants_ns{};      // of the last releases that were compared
  std::vector<double> live{};                // written by the live core in them
  std::vector<double> candidate{};           // written by the candidate in them
  std::vector<time_ns_t> new_instants_ns{};  // of the first releases of the new core that wrote the output
  std::vector<double> new_core{};            // written by the new core in them
};

/// | member         | written by                         | read by                   | order                               |
/// | -------------- | ---------------------------------- | ------------------------- | ----------------------------------- |
/// | numbers ... compared, compared_ | who executes the candidate   | the same; who tells of it | Shadow::figures_mutex_              |
/// | before, is_awaited, new_releases_ | the component's thread | the same           | -                                   |
/// | news           | the component's thread             | who tells of it           | news_count: those before it are complete |
/// | news_count     | the component's thread             | anyone                    | release/acquire: news               |
/// | instant_ns_    | the component's thread             | anyone                    | relaxed: a lone number; 0 until then |
/// | step           | the component's thread             | anyone                    | relaxed: a lone number; NaN until then |
class OutputSteps {
 public:
  /// So many releases of both cores before the swap are kept, and of the new core after it: 2.5 kB for each output.
  static constexpr std::size_t kCurve = 64;

  /// Throws Error: unknown_port, invalid_argument (no write port, no number there, a port that writes zero at each change). [non-rt]
  OutputSteps(const Shell& shell, const std::string& component, const std::vector<GreatestStep>& outputs);

  /// What the live core and the candidate wrote to a port in one release, by its place in the shell; nullptr: nothing. [non-rt]
  void note(std::size_t port, const void* live, const void* candidate);
  /// Whether each output is within its greatest step, in this release. An output that one of both has never written is not. [non-rt]
  bool compare(time_ns_t instant_ns);

  /// Before the swap: `written(port)` gives the last value that the old core has written to it. [rt], the component's thread
  template <typename Written>
  void note_last(const Written& written) MAUVE_RT {
    for (One& each : all_) {
      each.before = each.place.of(written(each.port));
      each.is_awaited = true;
    }
  }
  /// The first instant at which the component runs with the new core; does nothing when called again. [rt], the component's thread
  void note_swap(time_ns_t instant_ns) MAUVE_RT {
    if (instant_ns_.load(std::memory_order_relaxed) == 0)
      instant_ns_.store(instant_ns, std::memory_order_relaxed);
  }
  /// After a release of the new core: `written(port)` gives what it has written to it, or nullptr. [rt], the component's thread
  template <typename Written>
  void note_new(time_ns_t instant_ns, const Written& written) MAUVE_RT {
    for (One& each : all_) {
      const void* const value = written(each.port);
      if (value == nullptr) continue;
      const double number = each.place.of(value);
      if (std::exchange(each.is_awaited, false))
        each.step.store(number - each.before, std::memory_order_relaxed);
      // relaxed: this thread writes it
      const std::size_t count = each.news_count.load(std::memory_order_relaxed);
      if (count == kCurve) continue;
      each.news[count] = {.instant_ns = instant_ns, .number = number};
      each.news_count.store(count + 1, std::memory_order_release);
    }
    ++new_releases_;
  }
  /// Whether all steps are known. [rt], the component's thread
  bool are_known() const MAUVE_RT;
  /// Whether they are, and the curves have all releases that they keep. [rt], the component's thread
  bool is_complete() const MAUVE_RT { return new_releases_ >= kCurve && are_known(); }

  /// [non-rt]
  std::vector<OutputStep> shown() const;
  /// [non-rt]
  std::vector<OutputCurve> curves() const;

 private:
  struct Compared {
    time_ns_t instant_ns{0};
    double live{OutputStep::kUnknown};
    double candidate{OutputStep::kUnknown};
  };
  struct New {
    time_ns_t instant_ns{0};
    double number{OutputStep::kUnknown};
  };
  struct One {
    std::string output{};
    std::size_t port{0};
    NumberPlace place{};
    double greatest{0.0};
    double live{OutputStep::kUnknown};
    double candidate{OutputStep::kUnknown};
    double least{OutputStep::kUnknown};
    time_ns_t least_instant_ns{0};
    std::vector<Compared> compared = std::vector<Compared>(kCurve);  // a ring
    double before{OutputStep::kUnknown};
    bool is_awaited{false};
    std::vector<New> news = std::vector<New>(kCurve);
    Atomic<std::size_t> news_count{0};
    Atomic<double> step{OutputStep::kUnknown};
  };

  std::vector<One> all_;
  std::size_t compared_{0};  // releases
  std::size_t new_releases_{0};
  Atomic<time_ns_t> instant_ns_{0};
};

}  // namespace mauve

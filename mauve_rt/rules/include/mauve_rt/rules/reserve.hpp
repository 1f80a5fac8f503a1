// SPDX-License-Identifier: LGPL-3.0-or-later
// Reserve: what a rule does where its `do` does not come about.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/deploy/host.hpp"
#include "mauve_rt/rules/engine.hpp"

namespace mauve::rules {

enum class ReserveKind : std::uint8_t {
  stop,          // the components stop; one that still executes after kStopPatience is given up
  safe_outputs,  // one that executes is given up at once, one that waits stops
};

/// Stops components whatever they do: it needs no preparation, no vote and no end of a state. Who is given up is FAULTED, its
/// outputs are written as on a stop.
///
/// "decision thread", "reserve thread": see RuleRunner.
///
/// | member   | written by                                                       | read by | order                    |
/// | -------- | ---------------------------------------------------------------- | ------- | ------------------------ |
/// | stage_   | decision thread: idle -> begun, over -> idle; reserve thread: begun -> over | both | release/acquire: hands over has_failed_ |
/// | has_failed_ | reserve thread                                                | both    | by stage_                |
class Reserve {
 public:
  static constexpr time_ns_t kStopPatience = ms_to_ns(50);
  static constexpr time_ns_t kSafePatience = ms_to_ns(1);

  /// No components: the rule has none. [setup]
  explicit Reserve(ReserveKind kind = ReserveKind::stop, std::vector<std::string> components = {})
      : kind_(kind), components_(std::move(components)) {}
  Reserve(const Reserve&) = delete;
  Reserve& operator=(const Reserve&) = delete;

  /// [rt]
  bool exists() const MAUVE_RT { return !components_.empty(); }

  // ---- the decision thread

  /// [rt]
  void begin() MAUVE_RT { stage_.store(Stage::begun, std::memory_order_release); }
  /// How it has ended, once. [rt]
  std::optional<Ended> ended() MAUVE_RT;

  // ---- the reserve thread

  /// [rt]
  bool is_begun() const MAUVE_RT { return stage_.load(std::memory_order_acquire) == Stage::begun; }
  /// What was begun; returns why a component still runs, in words; empty: none does. [non-rt]
  std::string carry_out(Host& host) noexcept;
  /// The decision thread may know. [rt]
  void end() MAUVE_RT {
    MAUVE_EXPECTS(is_begun());
    stage_.store(Stage::over, std::memory_order_release);
  }

 private:
  enum class Stage : std::uint8_t { idle, begun, over };

  const ReserveKind kind_;
  const std::vector<std::string> components_;
  Atomic<Stage> stage_{Stage::idle};
  bool has_failed_{false};
};

}  // namespace mauve::rules

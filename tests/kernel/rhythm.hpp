// SPDX-License-Identifier: LGPL-3.0-or-later
// What the releases of one component have to be, whatever is done to it and to others.
#pragma once

#include <algorithm>
#include <deque>
#include <numeric>
#include <optional>
#include <utility>

#include "fixtures.hpp"

namespace mauve::testing {

/// The lengths of the waits of an fsm that goes round, in their order, and their names.
struct Plan {
  std::vector<time_ns_t> waits_ns;
  std::vector<std::string> names{};
  time_ns_t period_ns() const { return std::accumulate(waits_ns.begin(), waits_ns.end(), time_ns_t{0}); }
};

/// Follows a component through its trace: every record of a release, a wait, a park or a start comes at the instant that
/// the records before it and the changes made to it call for.
class Rhythm {
 public:
  /// `exact`: in virtual time nobody is ever late.
  Rhythm(std::string name, std::uint16_t number, time_ns_t epoch_ns, bool exact)
      : name_(std::move(name)), number_(number), epoch_ns_(epoch_ns), exact_(exact) {}

  /// A change has given it another fsm, or will once it is seen. `keeps_pending`: it goes on in the wait of the same name
  /// where that ends on the new grid; else it restarts at its pending instant where that lies on the grid, else at the next.
  void expect_start(Plan plan, bool keeps_pending) { starts_.push_back({std::move(plan), keeps_pending}); }

  void take(const TraceRecord& record) {
    switch (static_cast<TraceKind>(record.kind)) {
      case TraceKind::start:
        return take_start(record);
      case TraceKind::release:
        expect_due(record, "release");
        base_ns_ = record.a;
        ++releases_;
        return;
      case TraceKind::wait:
        in_wait_ = true;
        due_ns_ = base_ns_ + plan_.waits_ns[place_];
        place_ = (place_ + 1) % plan_.waits_ns.size();
        return expect_due(record, "wait");
      case TraceKind::overrun:
        expect_due(record, "overrun");
        EXPECT_FALSE(exact_) << name_ << " is late in virtual time";
        due_ns_ += record.c * plan_.period_ns();
        lost_ += record.c;
        return;
      case TraceKind::parked:
        return expect_due(record, "park");
      case TraceKind::reconfiguration:
        replaces_fsm_ |= TraceNames::word(record.name).starts_with("replace_fsm") ||
                         TraceNames::word(record.name).starts_with("replace_shell");
        return;
      case TraceKind::armed:
        if (std::exchange(replaces_fsm_, false)) take_kept_place();
        return take_armed(record);
      case TraceKind::stop:
        due_ns_ = 0;
        return;
      case TraceKind::fault:
        ADD_FAILURE() << name_ << " faulted in " << TraceNames::word(record.name);
        return;
      default:
        return;
    }
  }

  std::uint16_t number() const noexcept { return number_; }
  /// The instant that its release comes at next; 0 while it does not run.
  time_ns_t due_ns() const noexcept { return due_ns_; }
  std::int64_t releases() const noexcept { return releases_; }
  /// Instants that no release came at, told as overruns or passed by at a commit.
  std::int64_t lost() const noexcept { return lost_; }

 private:
  struct Start {
    Plan plan;
    bool keeps_pending;
  };

  void expect_due(const TraceRecord& record, const char* what) {
    EXPECT_EQ(due_ns_ - epoch_ns_, record.a - epoch_ns_)
        << name_ << ": " << what << " after " << releases_ << " releases, in ns after the epoch";
    due_ns_ = record.a;  // one difference is told once
  }

  /// The wait of the next fsm that ends at the pending instant, counted from the initial state.
  std::optional<std::size_t> kept_wait() const {
    const Start& next = starts_.front();
    if (!next.keeps_pending || !in_wait_ || due_ns_ == 0 || plan_.names.empty()) return std::nullopt;
    const std::string& name = plan_.names[(place_ + plan_.names.size() - 1) % plan_.names.size()];
    const auto found = std::find(next.plan.names.begin(), next.plan.names.end(), name);
    if (found == next.plan.names.end()) return std::nullopt;
    const auto index = static_cast<std::size_t>(found - next.plan.names.begin());
    time_ns_t end_ns = 0;
    for (std::size_t i = 0; i <= index; ++i) end_ns += next.plan.waits_ns[i];
    const Grid grid{.reference_ns = epoch_ns_, .period_ns = next.plan.period_ns()};
    return grid.phase_error(due_ns_ - end_ns) == 0 ? std::optional(index) : std::nullopt;
  }

  /// It was armed with another fsm, and has not started.
  void take_kept_place() {
    if (has_started_ || starts_.empty() || !starts_.front().keeps_pending) {
      has_started_ = false;
      return;
    }
    const std::optional<std::size_t> kept = kept_wait();
    ASSERT_TRUE(kept) << name_ << " goes on in its place, and has none in the new fsm";
    plan_ = starts_.front().plan;
    place_ = (*kept + 1) % plan_.waits_ns.size();
    starts_.pop_front();
  }

  void take_start(const TraceRecord& record) {
    ASSERT_FALSE(starts_.empty()) << name_ << " has started, and nobody asked for it";
    EXPECT_FALSE(replaces_fsm_ && kept_wait()) << name_ << " restarts, and has a place in the new fsm";
    has_started_ = replaces_fsm_;
    in_wait_ = false;
    const Start start = std::move(starts_.front());
    starts_.pop_front();
    const Grid grid{.reference_ns = epoch_ns_, .period_ns = start.plan.period_ns()};
    EXPECT_EQ(0, grid.phase_error(record.a)) << name_ << " starts beside its grid";
    if (start.keeps_pending && due_ns_ != 0) {
      const time_ns_t wanted = grid.first_not_before(due_ns_);
      if (exact_) {
        EXPECT_EQ(wanted - epoch_ns_, record.a - epoch_ns_)
            << name_ << ": pending was " << due_ns_ - epoch_ns_;
      } else {
        EXPECT_GE(record.a, wanted) << name_;
      }
      lost_ += (record.a - wanted) / grid.period_ns;
    }
    plan_ = start.plan;
    place_ = 0;
    due_ns_ = record.a;
  }

  void take_armed(const TraceRecord& record) {
    const time_ns_t passed_ns = record.a - due_ns_;
    EXPECT_GE(passed_ns, 0) << name_ << " goes on before its pending instant";
    EXPECT_EQ(0, passed_ns % plan_.period_ns()) << name_ << " goes on beside its grid";
    if (exact_) {
      EXPECT_EQ(0, passed_ns) << name_ << " goes on after its pending instant";
    }
    lost_ += passed_ns / plan_.period_ns();
    due_ns_ = record.a;
  }

  std::string name_;
  std::uint16_t number_;
  time_ns_t epoch_ns_;
  bool exact_;
  Plan plan_{};
  std::deque<Start> starts_{};
  bool in_wait_{false};       // not before its first release
  bool replaces_fsm_{false};  // by the change whose records come now
  bool has_started_{false};   // by that change
  std::size_t place_{0};      // of the wait entered next
  time_ns_t base_ns_{0};      // of the last release
  time_ns_t due_ns_{0};
  std::int64_t releases_{0};
  std::int64_t lost_{0};
};

}  // namespace mauve::testing

// SPDX-License-Identifier: LGPL-3.0-or-later
// What the releases of one component have to be, whatever is done to it and to others.
#pragma once

#include <deque>
#include <numeric>

#include "fixtures.hpp"

namespace mauve::testing {

/// The lengths of the waits of an fsm that goes round, in their order.
struct Plan {
  std::vector<time_ns_t> waits_ns;
  time_ns_t period_ns() const { return std::accumulate(waits_ns.begin(), waits_ns.end(), time_ns_t{0}); }
};

/// Follows a component through its trace: every record of a release, a wait, a park or a start comes at the instant that
/// the records before it and the changes made to it call for.
class Rhythm {
 public:
  /// `exact`: in virtual time nobody is ever late.
  Rhythm(std::string name, std::uint16_t number, time_ns_t epoch_ns, bool exact)
      : name_(std::move(name)), number_(number), epoch_ns_(epoch_ns), exact_(exact) {}

  /// A change has restarted it, or will once it is seen: `keeps_pending` at its pending instant where that lies on the new
  /// grid, else at the next one.
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
      case TraceKind::armed:
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

  void take_start(const TraceRecord& record) {
    ASSERT_FALSE(starts_.empty()) << name_ << " has started, and nobody asked for it";
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
      EXPECT_EQ(0, passed_ns) << name_ << " was held past its pending instant";
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
  std::size_t place_{0};  // of the wait entered next
  time_ns_t base_ns_{0};  // of the last release
  time_ns_t due_ns_{0};
  std::int64_t releases_{0};
  std::int64_t lost_{0};
};

}  // namespace mauve::testing

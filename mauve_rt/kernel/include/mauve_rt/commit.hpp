// SPDX-License-Identifier: LGPL-3.0-or-later
// A change to a running component, carried out on its own thread inside its wait.
#pragma once

#include <atomic>
#include <exception>
#include <string>

#include "mauve_rt/time.hpp"

namespace mauve {

/// What a commit does. Prepared on an ordinary thread; the two calls run on the component's thread, or on the
/// caller's while the component is parked.
class CommitAction {
 public:
  virtual ~CommitAction() = default;
  /// May refuse by returning false or throwing; changes nothing. [rt]
  virtual bool adopt() { return true; }
  /// Makes the change; cannot fail. [rt]
  virtual void take() noexcept = 0;
  virtual time_ns_t budget_ns() const noexcept { return us_to_ns(50); }
  virtual std::uint32_t trace_id() const noexcept { return 0; }
};

/// One commit under way. Owned by its requester; the component's thread holds a pointer to it only between
/// taking it out of its task's slot and setting `done` (or, for the release that follows, `released`), so it
/// cannot outlive the owner.
///
/// | member                 | written by                 | read by             | order                               |
/// | ---------------------- | -------------------------- | ------------------- | ----------------------------------- |
/// | results                | component, before done     | requester, after it | through done                        |
/// | release_*              | component, before released | requester, after it | through released                    |
/// | done, released (futex) | component                  | requester           | release/acquire: hand over the rest |
struct Commit {
  static constexpr std::uint32_t kReleased = 1;
  static constexpr std::uint32_t kSuperseded = 2;  // another commit came before the release

  explicit Commit(CommitAction& what) : action(what) {}

  CommitAction& action;

  bool committed{false};
  bool not_running{false};       // the component parked before it could
  std::exception_ptr refusal{};  // when adopt threw
  time_ns_t parked_ns{0};
  time_ns_t armed_ns{0};
  time_ns_t adopt_ns{0};
  time_ns_t take_ns{0};
  time_ns_t pending_ns{0};  // the instant pending at the park; 0: the component was parked already
  std::atomic<std::uint32_t> done{0};

  time_ns_t release_nominal_ns{0};  // of the release that follows
  time_ns_t release_actual_ns{0};
  std::atomic<std::uint32_t> released{0};
};

}  // namespace mauve

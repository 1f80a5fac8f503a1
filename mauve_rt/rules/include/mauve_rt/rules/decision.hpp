// SPDX-License-Identifier: LGPL-3.0-or-later
// Decisions: what an engine tells of each rule, whether it acted or not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve::rules {

/// What a rule can want.
enum class Act : std::uint8_t {
  do_,
  undo,
  otherwise,  // its reserve action: what `do` is about stops, as `do` does not come about
};
/// How many there are.
inline constexpr std::size_t kActs = 3;
/// The place of an act in a table of one entry per act. [rt]
constexpr std::size_t index_of(Act act) MAUVE_RT { return static_cast<std::size_t>(act); }

enum class Decided : std::uint8_t {
  armed,     // it watches
  disarmed,  // what it is about is not there, or does not run: it watches no longer
  adopted,   // what it does was in effect when it was armed: it is undone when it is time
  condition_true,
  condition_false,
  condition_unknown,  // nothing more is known of what it is about: what is in effect stays so
  do_,                // it begins what it does
  undo,               // it begins to undo that
  otherwise,          // it begins its reserve action
  done,               // what was begun is in effect
  failed,             // it is not; it is tried again after wait_ns
  suppressed,         // it wants something, and that is not begun: why, says Why
};

enum class Why : std::uint8_t {
  none,
  already,             // it is in effect without it
  changed_by_another,  // in older bags: somebody else had changed what it did
  cooldown,            // for wait_ns more
  outranked,           // by a rule of a higher priority that is about the same components: other
  in_flight,           // another rule's action is: other
  not_ready,           // it is not prepared
  refused,             // of failed: by the executor
  stale,               // of failed: what it was prepared against has changed
  withdrawn,           // of failed: something more urgent came between
  timed_out,           // of failed: the components were never in their waits together, or no answer came
};

/// One decision.
struct Decision {
  time_ns_t stamp_ns{0};
  std::int32_t rule{0};
  Decided decided{Decided::armed};
  Act act{Act::do_};  // of those about an action
  Why why{Why::none};
  std::int32_t other{-1};  // the other rule, where there is one
  time_ns_t cause_ns{0};   // since when the condition has been as it is
  time_ns_t sample_ns{0};  // what made it so: the last sample before a silence, the first one beyond a bound
  time_ns_t wait_ns{0};    // of cooldown and failed
  time_ns_t held_ns{
      0};  // of done and failed: for so long after its dwell time a higher rule or its cooldown held it back
  double measured{0.0};  // what the condition looks at: s of silence, a value, how many
};

/// Their names, as in SupervisorDecision.msg. [rt]
std::string_view name_of(Decided decided) MAUVE_RT;
std::string_view name_of(Act act) MAUVE_RT;
/// What a trace record of the kind `decision` calls it, with the act: `a` in TraceRecord.msg. [rt]
std::int64_t trace_code(const Decision& decision) MAUVE_RT;
/// In words, for people. [rt]
std::string_view words_of(Why why) MAUVE_RT;

}  // namespace mauve::rules

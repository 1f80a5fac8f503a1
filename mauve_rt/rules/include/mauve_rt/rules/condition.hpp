// SPDX-License-Identifier: LGPL-3.0-or-later
// Conditions: what the `when` of a rule asks, and the table of those that there are.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/rules/signal.hpp"

namespace mauve::rules {

/// Kleene's three values. What nothing was received of is unknown: no reason to act, and none to undo.
enum class Truth : std::uint8_t { no, yes, unknown };
/// [rt]
constexpr Truth truth_of(bool holds) MAUVE_RT { return holds ? Truth::yes : Truth::no; }

/// What a condition says at one instant.
struct Look {
  Truth truth{Truth::no};
  time_ns_t since_ns{0};        // the instant from which on it has been so
  time_ns_t next_ns{kForever};  // the first instant at which it can be otherwise though nothing is told
  time_ns_t look_ns{kForever};  // when to look again before that, though it is as it is then, too
  double measured{0.0};         // what it looks at: s of silence, a value, how many
  std::optional<time_ns_t> sample_ns{};  // the last sample before a silence; empty: since_ns

  /// [rt]
  bool holds() const MAUVE_RT { return truth == Truth::yes; }
  /// When that happened which made it so: the last sample before a silence, the first one beyond a bound. [rt]
  time_ns_t cause_ns() const MAUVE_RT { return sample_ns.value_or(since_ns); }
};

/// A condition at work. Asked from one thread, with instants that never go back.
class Condition {
 public:
  Condition() = default;
  virtual ~Condition() = default;
  Condition(const Condition&) = delete;
  Condition& operator=(const Condition&) = delete;

  /// What happened before does not count. [rt]
  virtual void arm(time_ns_t now_ns) MAUVE_RT = 0;
  /// Takes it to hold until something proves otherwise: it did when somebody acted on it. [rt]
  virtual void assume() MAUVE_RT {}
  /// [rt]
  virtual Look look(time_ns_t now_ns) MAUVE_RT = 0;
};

using Parameter = std::variant<bool, std::int64_t, double, std::string>;
using Parameters = std::map<std::string, Parameter>;

/// What a condition may be told.
struct ParameterSpec {
  std::string name;
  std::string
      type;  // bool, int, float, str; or what a text is: topic, message_type, component, resource, field, executor
  std::string unit{};
  std::optional<double> minimum{};
  std::optional<double> maximum{};
  std::optional<Parameter> initial{};  // of one that need not be told, and then is this
  bool required{false};
};

/// One kind of condition: a file in conditions/.
struct ConditionKind {
  std::string name;
  std::string summary;  // when it holds
  std::vector<ParameterSpec> parameters;
  /// What it hears, in an order of its own. Throws Error (invalid_value): what it was told makes no sense together.
  std::function<std::vector<SignalSpec>(const Parameters&)> hears;
  /// With the signals in that order; the parameters are complete.
  std::function<std::unique_ptr<Condition>(const Parameters&, std::span<Signal* const>)> make;
};

/// All kinds. [non-rt]
const std::vector<ConditionKind>& condition_kinds();
/// The kind of a name; nullptr: there is none. [non-rt]
const ConditionKind* find_condition_kind(const std::string& name);

/// A tree of conditions, as a rules file has it.
struct When {
  std::string kind{};         // of a condition; or all, any, not, at_least
  Parameters parameters{};    // of a condition; those not told have their initial values
  std::vector<When> parts{};  // of the others
  std::int64_t count{0};      // of at_least
  time_ns_t for_ns{0};        // it has to have held so long without a break
  time_ns_t within_ns{0};     // it need have held (so long) only at some instant of the last so many

  bool operator==(const When&) const = default;
};

/// Gives a condition a signal: one of its own, since it listens to it in its own way. [setup]
using GiveSignal = std::function<Signal&(const SignalSpec&)>;
/// The tree at work. [setup] Throws Error: a kind or parameter that there is not, or that may not be so.
std::unique_ptr<Condition> make_condition(const When& when, const GiveSignal& give);

}  // namespace mauve::rules

// SPDX-License-Identifier: LGPL-3.0-or-later
// Conditions of conditions: all, any, not, at_least; and how long they have held.
#include <algorithm>

#include "conditions/kinds.hpp"

namespace mauve::rules {

namespace {

/// Holds while at least so many of its parts hold.
class AtLeast final : public Condition {
 public:
  AtLeast(std::vector<std::unique_ptr<Condition>> parts, std::size_t count)
      : parts_(std::move(parts)), count_(count) {}
  void arm(time_ns_t now_ns) noexcept override {
    for (const auto& part : parts_) part->arm(now_ns);
    truth_ = Truth::unknown;
    since_ns_ = cause_ns_ = now_ns;
  }
  void assume() noexcept override {
    for (const auto& part : parts_) part->assume();
  }
  Look look(time_ns_t now_ns) noexcept override {
    std::size_t holding = 0;
    std::size_t unknown = 0;
    Look answer;
    bool is_measured = false;
    time_ns_t latest_ns = since_ns_;
    time_ns_t cause_ns = cause_ns_;
    for (const auto& part : parts_) {
      const Look look = part->look(now_ns);
      holding += look.holds() ? 1 : 0;
      unknown += look.truth == Truth::unknown ? 1 : 0;
      if (look.since_ns >= latest_ns) {
        latest_ns = look.since_ns;
        cause_ns = look.cause_ns();
      }
      answer.next_ns = std::min(answer.next_ns, look.next_ns);
      answer.look_ns = std::min(answer.look_ns, look.look_ns);
      if (!is_measured) answer.measured = look.measured;  // of the first that holds, or else the last
      is_measured |= look.holds();
    }
    answer.truth = truth_of(holding >= count_);
    if (!answer.holds() && holding + unknown >= count_) answer.truth = Truth::unknown;
    if (answer.truth != truth_) {  // what changed last has changed it
      since_ns_ = latest_ns;
      cause_ns_ = cause_ns;
    }
    truth_ = answer.truth;
    answer.since_ns = since_ns_;
    answer.sample_ns = cause_ns_;
    return answer;
  }

 private:
  const std::vector<std::unique_ptr<Condition>> parts_;
  const std::size_t count_;
  Truth truth_{Truth::unknown};
  time_ns_t since_ns_{0};
  time_ns_t cause_ns_{0};
};

class Not final : public Condition {
 public:
  explicit Not(std::unique_ptr<Condition> part) : part_(std::move(part)) {}
  void arm(time_ns_t now_ns) noexcept override { part_->arm(now_ns); }
  // What would make this one hold cannot be assumed of the part: it is seen.
  Look look(time_ns_t now_ns) noexcept override {
    Look look = part_->look(now_ns);
    if (look.truth != Truth::unknown) look.truth = truth_of(!look.holds());
    return look;
  }

 private:
  const std::unique_ptr<Condition> part_;
};

/// Holds while its part has held for so long without a break. Until then it is as it was before the part held.
class For final : public Condition {
 public:
  For(std::unique_ptr<Condition> part, time_ns_t for_ns) : part_(std::move(part)), for_ns_(for_ns) {}
  void arm(time_ns_t now_ns) noexcept override {
    part_->arm(now_ns);
    before_ = {.truth = Truth::unknown, .since_ns = now_ns};
    is_assumed_ = false;
  }
  void assume() noexcept override {
    part_->assume();
    is_assumed_ = true;
  }
  Look look(time_ns_t now_ns) noexcept override {
    Look look = part_->look(now_ns);
    if (!look.holds()) {
      if (look.truth == Truth::no) is_assumed_ = false;
      return before_ = look;
    }
    const time_ns_t due_ns = later_by(look.since_ns, for_ns_);
    if (is_assumed_ || now_ns >= due_ns) {
      look.sample_ns = look.cause_ns();
      if (!is_assumed_) look.since_ns = due_ns;
      return look;
    }
    return {.truth = before_.truth,
            .since_ns = before_.since_ns,
            .next_ns = std::min(look.next_ns, due_ns),
            .look_ns = look.look_ns,
            .measured = look.measured};
  }

 private:
  const std::unique_ptr<Condition> part_;
  const time_ns_t for_ns_;
  Look before_{};
  bool is_assumed_{false};
};

/// Holds while its part holds, and so long after that.
class Within final : public Condition {
 public:
  Within(std::unique_ptr<Condition> part, time_ns_t within_ns)
      : part_(std::move(part)), within_ns_(within_ns) {}
  void arm(time_ns_t now_ns) noexcept override {
    part_->arm(now_ns);
    did_part_hold_ = false;
    truth_ = Truth::unknown;
    since_ns_ = cause_ns_ = now_ns;
  }
  void assume() noexcept override { part_->assume(); }
  Look look(time_ns_t now_ns) noexcept override {
    Look look = part_->look(now_ns);
    if (look.holds()) {
      if (truth_ != Truth::yes) {
        since_ns_ = look.since_ns;
        cause_ns_ = look.cause_ns();
      }
      did_part_hold_ = true;
    } else {
      if (std::exchange(did_part_hold_, false)) ends_ns_ = later_by(look.since_ns, within_ns_);
      if (truth_ == Truth::yes && now_ns < ends_ns_) {
        look.truth = Truth::yes;
        look.next_ns = std::min(look.next_ns, ends_ns_);
      } else if (truth_ == Truth::yes) {
        since_ns_ = ends_ns_;
        cause_ns_ = ends_ns_ - within_ns_;
      } else if (truth_ != look.truth) {
        since_ns_ = std::max(since_ns_, look.since_ns);
        cause_ns_ = std::max(cause_ns_, look.cause_ns());
      }
    }
    truth_ = look.truth;
    look.since_ns = since_ns_;
    look.sample_ns = cause_ns_;
    return look;
  }

 private:
  const std::unique_ptr<Condition> part_;
  const time_ns_t within_ns_;
  bool did_part_hold_{false};    // at the look before
  Truth truth_{Truth::unknown};  // this one, at the look before
  time_ns_t ends_ns_{0};
  time_ns_t since_ns_{0};
  time_ns_t cause_ns_{0};
};

std::string joined(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  return all;
}

[[noreturn]] void refuse(const std::string& kind, const std::string& name, const std::string& expected,
                         const std::string& found, const std::string& remedy) {
  throw Error(ErrorCode::invalid_argument, "a condition of kind " + kind + " cannot be so",
              {.element = name, .expected = expected, .found = found, .remedy = remedy});
}

std::string shown(const Parameter& parameter) {
  if (const auto* flag = std::get_if<bool>(&parameter)) return *flag ? "true" : "false";
  if (const auto* whole = std::get_if<std::int64_t>(&parameter)) return std::to_string(*whole);
  if (const auto* real = std::get_if<double>(&parameter)) return std::to_string(*real);
  return std::get<std::string>(parameter);
}

void check(const ConditionKind& kind, const ParameterSpec& spec, const Parameter& found) {
  const bool is_number = std::holds_alternative<std::int64_t>(found) ||
                         (spec.type == "float" && std::holds_alternative<double>(found));
  if (spec.type == "int" || spec.type == "float") {
    if (!is_number) refuse(kind.name, spec.name, spec.type, shown(found), "give a number");
    const double number = std::holds_alternative<double>(found)
                              ? std::get<double>(found)
                              : static_cast<double>(std::get<std::int64_t>(found));
    const bool fits = !std::isnan(number) && number >= spec.minimum.value_or(-kInfinity) &&
                      number <= spec.maximum.value_or(kInfinity);
    if (fits) return;
    const std::string low = spec.minimum ? std::to_string(*spec.minimum) : "-inf";
    const std::string high = spec.maximum ? std::to_string(*spec.maximum) : "inf";
    refuse(kind.name, spec.name, low + " to " + high, shown(found), "give a value in that range");
  }
  if (spec.type == "bool") {
    if (!std::holds_alternative<bool>(found))
      refuse(kind.name, spec.name, "true or false", shown(found), "give one of these");
    return;
  }
  const auto* word = std::get_if<std::string>(&found);
  if (word == nullptr) refuse(kind.name, spec.name, "a text", shown(found), "give a text");
  if (spec.type.find('|') == std::string::npos) return;
  if (("|" + spec.type + "|").find("|" + *word + "|") == std::string::npos)
    refuse(kind.name, spec.name, "one of " + spec.type, *word, "give one of these");
}

Parameters completed(const ConditionKind& kind, const Parameters& given) {
  Parameters all = given;
  std::vector<std::string> names;
  for (const ParameterSpec& spec : kind.parameters) {
    names.push_back(spec.name);
    const auto found = all.find(spec.name);
    if (found != all.end()) {
      check(kind, spec, found->second);
    } else if (spec.required) {
      refuse(kind.name, spec.name, "a " + spec.type, "nothing", "add it");
    } else if (spec.initial) {
      all[spec.name] = *spec.initial;
    }
  }
  for (const auto& [name, parameter] : given) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      refuse(kind.name, name, "one of " + joined(names), name, "correct the name");
  }
  return all;
}

std::unique_ptr<Condition> make_leaf(const When& when, const GiveSignal& give) {
  const ConditionKind* kind = find_condition_kind(when.kind);
  if (kind == nullptr) {
    std::vector<std::string> names{"all", "any", "not", "at_least"};
    for (const ConditionKind& each : condition_kinds()) names.push_back(each.name);
    throw Error(ErrorCode::invalid_argument, "there is no condition of this kind",
                {.expected = "one of " + joined(names), .found = when.kind, .remedy = "correct the name"});
  }
  const Parameters parameters = completed(*kind, when.parameters);
  std::vector<Signal*> signals;
  for (const SignalSpec& spec : kind->hears(parameters)) signals.push_back(&give(spec));
  return kind->make(parameters, signals);
}

std::unique_ptr<Condition> make_combination(const When& when, const GiveSignal& give) {
  std::vector<std::unique_ptr<Condition>> parts;
  for (const When& part : when.parts) parts.push_back(make_condition(part, give));
  const std::size_t many = parts.size();
  if (many == 0) refuse(when.kind, "parts", "one at least", "none", "name what it is made of");
  if (when.kind == "not") {
    if (many != 1) refuse(when.kind, "parts", "one", std::to_string(many), "use any or all within it");
    return std::make_unique<Not>(std::move(parts.front()));
  }
  if (when.kind == "all") return std::make_unique<AtLeast>(std::move(parts), many);
  if (when.kind == "any") return std::make_unique<AtLeast>(std::move(parts), 1);
  if (when.count < 1 || when.count > static_cast<std::int64_t>(many))
    refuse(when.kind, "count", "1 to " + std::to_string(many), std::to_string(when.count),
           "give one of these");
  return std::make_unique<AtLeast>(std::move(parts), static_cast<std::size_t>(when.count));
}

}  // namespace

const std::vector<ConditionKind>& condition_kinds() {
#define MAUVE_LIST_KIND(name) name##_kind(),
  static const std::vector<ConditionKind> kinds{MAUVE_CONDITION_KINDS(MAUVE_LIST_KIND)};
#undef MAUVE_LIST_KIND
  return kinds;
}

const ConditionKind* find_condition_kind(const std::string& name) {
  for (const ConditionKind& kind : condition_kinds()) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

std::unique_ptr<Condition> make_condition(const When& when, const GiveSignal& give) {
  const bool combines =
      when.kind == "all" || when.kind == "any" || when.kind == "not" || when.kind == "at_least";
  std::unique_ptr<Condition> made = combines ? make_combination(when, give) : make_leaf(when, give);
  if (when.for_ns > 0) made = std::make_unique<For>(std::move(made), when.for_ns);
  if (when.within_ns > 0) made = std::make_unique<Within>(std::move(made), when.within_ns);
  return made;
}

}  // namespace mauve::rules

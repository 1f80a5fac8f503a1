// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/probation.hpp"

#include <cmath>
#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/run/component.hpp"

#include "base/number_text.hpp"

namespace mauve {

namespace {

/// Of a value without a named field; each of its numbers is looked at in each write.
constexpr std::size_t kMostLimits = 1'000;

[[noreturn]] void refuse_option(const char* what, const std::string& component, const std::string& element,
                                const std::string& expected, const std::string& found, const char* remedy) {
  throw Error(
      ErrorCode::invalid_argument, what,
      {.component = component, .element = element, .expected = expected, .found = found, .remedy = remedy});
}

void check_bounds(const OutputLimit& limit, const std::string& component) {
  const std::string element = "output " + limit.port + (limit.field.empty() ? "" : "." + limit.field);
  const auto refuse = [&](const char* what, const std::string& expected, const std::string& found) {
    refuse_option(what, component, element, expected, found, "correct the minimum and the maximum");
  };
  for (const auto& [name, bound] :
       {std::pair{"minimum", limit.minimum}, std::pair{"maximum", limit.maximum}}) {
    if (bound && !std::isfinite(*bound))
      refuse("a bound of the limit is no finite number", std::string("a finite ") + name + ", or none",
             name + (" " + number_text(*bound)));
  }
  if (limit.minimum && limit.maximum && *limit.minimum > *limit.maximum)
    refuse("no number is within the limit", "minimum <= maximum",
           "minimum " + number_text(*limit.minimum) + ", maximum " + number_text(*limit.maximum));
}

}  // namespace

void check_options(const ProbationOptions& options, const std::string& component) {
  if (options.duration_ns <= 0 || options.duration_ns > kLongest)
    refuse_option("a probation cannot last that long", component, "duration_ns",
                  "1 to " + std::to_string(kLongest) + " ns", std::to_string(options.duration_ns),
                  "give a duration in which the component has some releases");
  if (options.min_releases < 1)
    refuse_option("a probation cannot pass without a release", component, "min_releases", "at least 1",
                  std::to_string(options.min_releases), "give the number of releases that the verdict needs");
  for (const OutputLimit& limit : options.outputs) check_bounds(limit, component);
}

class Probation::PortLimits final : public OutputWatch {
 public:
  PortLimits(Probation& probation, PortBase& its_port) : port(its_port), probation_(probation) {}
  bool admits(const void* value) noexcept override {
    if (!probation_.is_watched()) return true;
    for (const Limit& limit : limits) {
      const double number = limit.place.of(value);
      const bool is_within = number >= limit.minimum && number <= limit.maximum;  // false for NaN
      const bool is_free = !limit.is_bounded && !std::isnan(number);
      if (is_within || is_free) continue;
      probation_.find({.cause = ProbationCause::output,
                       .instant_ns = probation_.component_.task().entered_ns(),
                       .port = this,
                       .limit = &limit,
                       .number = number});
      return false;
    }
    return true;
  }

  PortBase& port;
  std::vector<Limit> limits;

 private:
  Probation& probation_;
};

const char* to_string(ProbationVerdict verdict) noexcept {
  switch (verdict) {
    case ProbationVerdict::running:
      return "running";
    case ProbationVerdict::passed:
      return "passed";
    case ProbationVerdict::reverted:
      return "reverted";
    case ProbationVerdict::inconclusive:
      return "inconclusive";
  }
  return "inconclusive";
}

Probation::Probation(Component& component, const std::string& to_core, ProbationOptions options)
    : component_(component),
      from_core_(component.core_implementation()),
      to_core_(to_core),
      options_(std::move(options)),
      trace_id_(TraceNames::intern("revert_core " + from_core_)) {
  check_options(options_, component.name());
  for (const OutputLimit& limit : options_.outputs) add(limit);
}

Probation::~Probation() = default;

void Probation::add(const OutputLimit& limit) {
  PortBase& port = component_.require_port(limit.port);
  const auto refuse = [&](const char* what, const std::string& expected, const std::string& found,
                          const char* remedy) {
    throw Error(ErrorCode::invalid_argument, what,
                {.component = component_.name(),
                 .element = "output " + limit.port,
                 .expected = expected,
                 .found = found,
                 .remedy = remedy});
  };
  if (port.kind() != PortKind::write)
    refuse("a limit is set to an output", "a write port", std::string(to_string(port.kind())),
           "name one of the component's write ports");
  if (!limit.minimum && !limit.maximum && !limit.not_nan)
    refuse("the limit sets no bound", "minimum, maximum or not_nan", "none", "give one of them");
  std::vector<std::string> paths{limit.field};
  if (limit.field.empty()) {
    paths.clear();
    for (const MessageShape& message : port.messages()) paths = number_paths(message, kMostLimits);
  }
  if (paths.size() > kMostLimits)
    refuse("the value has too many numbers", "at most " + std::to_string(kMostLimits) + " numbers", "more",
           "name the field of one number");
  PortLimits& own = limits_of(port);
  for (const std::string& path : paths) {
    const std::optional<NumberPlace> place = port.find_number(path);
    if (!place.has_value()) {
      refuse("the output has no number there that can be read in real time",
             "a field of " + port.type() + " that is a number, not in a text or a list without a bound", path,
             "name the field of a number");
    }
    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    own.limits.push_back({.path = path,
                          .place = place.value_or(NumberPlace{}),
                          .minimum = limit.minimum.value_or(-kInfinite),
                          .maximum = limit.maximum.value_or(kInfinite),
                          .is_bounded = limit.minimum || limit.maximum});
  }
  if (paths.empty())
    refuse("the output has no number that can be read in real time",
           "a C++ struct with numbers at fixed places", port.type(),
           "leave the limit out, or watch the output by a rule");
}

/// A port has one watch.
Probation::PortLimits& Probation::limits_of(PortBase& port) {
  for (const auto& limits : limits_) {
    if (&limits->port == &port) return *limits;
  }
  return *limits_.emplace_back(std::make_unique<PortLimits>(*this, port));
}

// ---- the component's thread, or who acts for a parked one

void Probation::begin(PartsChange& parts) noexcept {
  MAUVE_EXPECTS(phase() == kPrepared);
  const Task& task = component_.task();
  parts_ = &parts;
  overruns_ = task.statistics().overruns.load(std::memory_order_relaxed);  // relaxed: this thread counts them
  begin_ns_ = task.clock().now_ns();
  end_ns_ = later_by(begin_ns_, options_.duration_ns);
  phase_.store(kRunning, std::memory_order_release);  // release: who reads it finds all this
  for (const auto& limits : limits_) limits->port.watch(*limits);
  component_.task().set_probation(*this);
  component_.set_next_probation(*this);
}

bool Probation::is_watched() const noexcept {
  return phase() == kRunning && component_.task().entered_ns() < end_ns_;
}

void Probation::find(const Found& found) noexcept {
  if (found_.cause == ProbationCause::none) found_ = found;
}

bool Probation::end_release() noexcept {
  if (phase() != kRunning) return false;
  const Task& task = component_.task();
  const std::uint64_t overruns = task.statistics().overruns.load(std::memory_order_relaxed);  // as in begin()
  const bool has_overrun = std::exchange(overruns_, overruns) != overruns;
  if (is_watched()) {
    releases_.store(releases_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    if (options_.on_overrun && has_overrun)
      find({.cause = ProbationCause::overrun, .instant_ns = task.entered_ns()});
  }
  note_request();
  return found_.cause != ProbationCause::none;
}

bool Probation::note_fault(const FaultNote& fault) noexcept {
  if (!is_watched()) return false;
  const Task& task = component_.task();
  const bool has_overrun = task.statistics().overruns.load(std::memory_order_relaxed) != overruns_;
  const bool is_over_declared = fault.bound_ns != 0;
  ProbationCause cause = ProbationCause::none;
  if (is_over_declared && (options_.on_fault || options_.on_over_declared)) {
    cause = ProbationCause::over_declared;
  } else if (options_.on_fault) {
    cause = ProbationCause::fault;
  } else if (options_.on_overrun && has_overrun) {
    cause = ProbationCause::overrun;  // whose policy is fault
  }
  if (cause != ProbationCause::none && found_.cause == ProbationCause::none) {
    MAUVE_AUDIT(fault_ == nullptr);  // so the assignment frees nothing
    MAUVE_RT_TRUSTED(fault_ = fault.what);
    fault_bound_ns_ = fault.bound_ns;
    fault_cpu_ns_ = fault.cpu_ns;
    fault_where_ = fault.where;
    find({.cause = cause, .instant_ns = task.entered_ns()});
  }
  note_request();
  return found_.cause != ProbationCause::none;
}

bool Probation::note_request() noexcept {
  if (phase() != kRunning) return false;
  if (is_requested_.load(std::memory_order_acquire))
    find({.cause = ProbationCause::request, .instant_ns = component_.task().entered_ns()});
  return found_.cause != ProbationCause::none;
}

bool Probation::begin_end() noexcept {
  std::uint32_t running = kRunning;
  if (!phase_.compare_exchange_strong(running, kEnding, std::memory_order_acq_rel)) return false;
  for (const auto& limits : limits_) limits->port.unwatch(*limits);
  return true;
}

void Probation::end(Phase phase, ProbationCause why) noexcept {
  MAUVE_EXPECTS(this->phase() == kEnding && phase >= kConcluded);
  if (cause_ != ProbationCause::hung) {  // else it was decided when the core was taken over
    cause_ = why;
    ended_ns_ = component_.task().clock().now_ns();
  }
  phase_.store(phase, std::memory_order_release);  // release: the cause, and parts that were put back
  futex_wake_all(phase_);
}

bool Probation::put_back() noexcept {
  if (found_.cause == ProbationCause::none || !MAUVE_RT_TRUSTED(parts_->take_old_core()) || !begin_end())
    return false;
  parts_->put_back();
  end(kReverted, found_.cause);
  return true;
}

void Probation::conclude(ProbationCause why) noexcept {
  if (begin_end()) return end(kConcluded, why);
  // Of one that was taken over, other parts replace the core that hung; the end of its host leaves the old core to the next cleanup.
  if (why == ProbationCause::replaced || why == ProbationCause::fell_back) end_comeback();
}

// ---- ordinary threads

void Probation::name_request(const std::string& reason) {
  const LockGuard lock(request_mutex_);
  if (request_.empty()) request_ = reason;
}

void Probation::request(const std::string& reason) {
  const LockGuard lock(request_mutex_);
  if (is_requested_.load(std::memory_order_relaxed))
    return;  // relaxed: under the mutex; the first one counts
  request_ = reason;
  is_requested_.store(true, std::memory_order_release);
}

bool Probation::wait_ended(time_ns_t until_ns) const noexcept {
  for (auto seen = phase_.load(std::memory_order_acquire); seen < kConcluded;
       seen = phase_.load(std::memory_order_acquire)) {
    if (!futex_wait_until(phase_, seen, until_ns)) return has_ended();
  }
  return true;
}

/// Whether the core that is watched executes a state, which has to end, or to be given up, before anything is decided.
bool Probation::is_executing() noexcept {
  Task& task = component_.task();
  if (task.is_simulated() || task.is_parked()) return false;
  if (task.is_left_behind()) return true;
  const StateAge age = task.state_age();
  if (age.is_wait || age.age_ns == 0 || !is_watched()) return false;
  if (age.age_ns > age.hung_after_ns && !options_.is_blend) task.give_up_on_probation(age);
  return true;
}

bool Probation::conclude_if_over() noexcept {
  if (phase() == kRunning && !is_executing() && component_.task().clock().now_ns() >= end_ns_) {
    const bool is_enough = releases_.load(std::memory_order_relaxed) >= options_.min_releases;
    conclude(is_enough ? ProbationCause::none : ProbationCause::too_few);
  }
  return has_ended();
}

std::unique_ptr<CoreBase> Probation::take_over() noexcept {
  if (!begin_end()) {
    const LockGuard lock(request_mutex_);
    return std::move(core_back_);
  }
  auto core = parts_->give_back_core();
  hung_for_ns_ = component_.task().state_age().age_ns;
  cause_ = ProbationCause::hung;
  ended_ns_ = component_.task().clock().now_ns();
  phase_.store(kTakenOver, std::memory_order_release);  // release: the facts before
  return core;
}

void Probation::give_back(std::unique_ptr<CoreBase>& core) noexcept {
  if (core == nullptr) return;
  const LockGuard lock(request_mutex_);
  if (phase() != kTakenOver) return;
  core->bind_shell(component_.shell());  // that of the component that has not come goes
  core->set_context(&component_.task().context());
  core_back_ = std::move(core);
}

bool Probation::has_core_back() const {
  const LockGuard lock(request_mutex_);
  return core_back_ != nullptr;
}

/// From then on only the caller ends it.
bool Probation::end_taken_over() noexcept {
  std::uint32_t taken_over = kTakenOver;
  return phase_.compare_exchange_strong(taken_over, kEnding, std::memory_order_acq_rel);
}

void Probation::end_comeback() noexcept {
  if (end_taken_over()) end(kReverted, ProbationCause::hung);
}

bool Probation::put_back_taken() noexcept {
  if (!has_core_back() || !end_taken_over()) return false;
  {
    const LockGuard lock(request_mutex_);
    parts_->take_core_back(std::move(core_back_));
  }
  parts_->put_back();
  end(kReverted, ProbationCause::hung);
  return true;
}

/// While one that hangs is on probation, only a shutdown ends it besides.
bool Probation::is_taken_over() const noexcept {
  const Phase now = phase();
  return now == kEnding || now == kTakenOver || (now == kReverted && cause_ == ProbationCause::hung);
}

bool Probation::claim_comeback() noexcept {
  return phase() == kRunning && reverts_hang() && component_.task().is_given_up_on_probation() &&
         !is_comeback_claimed_.exchange(true, std::memory_order_relaxed);  // relaxed: a lone flag
}

void Probation::note_left_out(const std::string& why) {
  const LockGuard lock(request_mutex_);
  left_out_ = why;
}

const FsmBase& Probation::old_fsm() const noexcept {
  const FsmBase* const out = parts_->fsm_out();
  return out != nullptr ? *out : component_.fsm();
}

void Probation::keep(std::unique_ptr<PartsChange> parts) noexcept { kept_ = std::move(parts); }

std::unique_ptr<PartsChange> Probation::release_parts() noexcept {
  const LockGuard lock(request_mutex_);
  if (core_back_ != nullptr && kept_ != nullptr)
    kept_->take_core_back(std::move(core_back_));  // it is cleaned up with them
  return std::move(kept_);
}

ProbationRecord Probation::record() const {
  const Phase now = phase();
  ProbationRecord record{.component = component_.name(),
                         .from_core = from_core_,
                         .to_core = to_core_,
                         .releases = releases_.load(std::memory_order_relaxed),
                         .begin_ns = begin_ns_,
                         .end_ns = end_ns_};
  if (now == kRunning && reverts_hang() && component_.task().is_given_up_on_probation()) {
    record.verdict = ProbationVerdict::reverted;
    record.cause = ProbationCause::fault;
    const LockGuard lock(request_mutex_);
    record.reason = component_.task().fault().what + "; the old core " +
                    (left_out_.empty() ? "goes in when it ends" : "does not go on: " + left_out_);
  }
  if (now < kTakenOver) return record;
  record.cause = cause_;
  record.end_ns = ended_ns_;
  record.reason = reason();
  record.verdict = now == kReverted || now == kTakenOver ? ProbationVerdict::reverted
                   : cause_ == ProbationCause::none      ? ProbationVerdict::passed
                                                         : ProbationVerdict::inconclusive;
  return record;
}

std::string Probation::reason() const {
  const std::string at = " at instant " + std::to_string(found_.instant_ns) + " ns";
  switch (cause_) {
    case ProbationCause::none:
      return {};
    case ProbationCause::fault:
      return "fault: " + (fault_ != nullptr ? *fault_ : std::string("an execution over its bound")) +
             " in state " + TraceNames::word(fault_where_);
    case ProbationCause::over_declared:
      if (fault_cpu_ns_ != 0) {
        const FaultNote note{.bound_ns = fault_bound_ns_, .cpu_ns = fault_cpu_ns_, .where = fault_where_};
        return "execution over declared: " + note.over_budget() + at;
      }
      return "execution over declared: state " + TraceNames::word(fault_where_) + " ran longer than its " +
             std::to_string(fault_bound_ns_ / us_to_ns(1)) + " us" + at;
    case ProbationCause::overrun:
      return "overrun" + at;
    case ProbationCause::output: {
      const std::string& path = found_.limit->path;
      std::string text = "output " + component_.name() + "." + found_.port->port.name() +
                         (path.empty() ? "" : "." + path) + " is " + number_text(found_.number);
      if (found_.number < found_.limit->minimum) text += ", below " + number_text(found_.limit->minimum);
      if (found_.number > found_.limit->maximum) text += ", above " + number_text(found_.limit->maximum);
      return text;
    }
    case ProbationCause::request: {
      const LockGuard lock(request_mutex_);
      return request_;
    }
    case ProbationCause::too_few:
      return std::to_string(releases_.load(std::memory_order_relaxed)) + " releases, expected at least " +
             std::to_string(options_.min_releases);
    case ProbationCause::replaced:
      return "another change replaced parts of the component";
    case ProbationCause::fell_back:
      return "the core faulted, which on_fault did not watch, and the fallback core took over";
    case ProbationCause::hung: {
      const LockGuard lock(request_mutex_);
      const std::string what = component_.task().fault().what;
      if (left_out_.empty())
        return what + "; the old core goes on by another thread, " +
               std::to_string(hung_for_ns_ / ms_to_ns(1)) + " ms after the state began";
      return what + "; the old core does not go on: " + left_out_;
    }
    case ProbationCause::ended:
      return "the component was cleaned up or removed, or its host was shut down";
    case ProbationCause::blend_ended:
      return "the blend of the outputs ended early";
  }
  return {};
}

}  // namespace mauve

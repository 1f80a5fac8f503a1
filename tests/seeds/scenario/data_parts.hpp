// SPDX-License-Identifier: LGPL-3.0-or-later
// The components of random_data: each execution reads, writes, calls and raises at random, and notes all of it.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/mauve_rt.hpp"

#include "../forked_run.hpp"
#include "data_history.hpp"
#include "dice.hpp"

namespace mauve::testing {

inline constexpr time_ns_t kDataSlack = ms_to_ns(80);
inline constexpr std::uint32_t kUntouched = 77;
inline constexpr int kOutside = -1;  // who calls is no component

/// One call of a client.
struct Asked {
  std::string client;
  std::uint64_t began, ended{UINT64_MAX};
  CallOutcome outcome{CallOutcome::answered};
};
/// What has become of a question on the side of who answers.
struct Answering {
  time_ns_t began_ns{0};
  time_ns_t ended_ns{0};  // 0: it has no answer yet
  bool is_malformed{false};
};
struct Raises {
  std::uint64_t begun{0};
  std::uint64_t ended{0};
  std::uint64_t last{0};  // the tick at which the last one began
};

/// What all parts of a run share. One thread runs at a time: nothing needs a lock.
struct DataShared {
  explicit DataShared(seeds::Findings& all) : findings(all) {}
  seeds::Findings& findings;
  std::map<std::string, ResourceHistory> resources{};
  std::map<std::string, time_ns_t> call_timeouts{};  // of clients
  std::map<std::uint32_t, Answering> answers{};      // by question
  std::vector<Asked> asked{};
  Raises raises{};
  bool is_quiet{false};                       // nothing is written, called or raised any more
  std::set<int> stop_asked{};                 // components, since their last start
  std::set<int> given_up{};                   // cores of components that a stop by force was asked for
  std::map<int, std::uint64_t> last_count{};  // of raises, as each component has read it
  std::map<int, double> last_small{};
  double next_number{0.0};
  std::uint32_t next_question{0};

  ResourceHistory* history(const PortBase& port) {
    const auto found = resources.find(port.connected_to().resource);
    return found != resources.end() ? &found->second : nullptr;
  }

  // ---- uses by anybody; `use` is what the seed wants of the port or of the service

  template <typename Value, typename Write>
  void write(ResourceHistory& history, time_ns_t stamp_ns, Write&& use) {
    const double number = ++next_number;
    const std::size_t index = history.begin_write(number, stamp_ns);
    const auto [accepted, may_be_dropped] = use(value_of<Value>(number));
    history.end_write(index, accepted, may_be_dropped);
  }
  template <typename Read>
  double read(ResourceHistory& history, Read&& use) {
    return read(history, [] { return true; }, std::forward<Read>(use));
  }
  template <typename Valid, typename Read>
  double read(ResourceHistory& history, Valid&& is_valid, Read&& use) {
    const std::size_t index = history.begin_read();
    const auto [value, status, stamp_ns] = use();
    if (!is_valid() && !history.is_ring) return 0.0;
    const bool has_new = status == DataStatus::new_data;
    const bool has_value = history.is_ring ? has_new : status != DataStatus::none;
    const double number = has_value ? number_of(value) : 0.0;
    history.end_read(index, number, has_new && number != 0.0, has_value ? stamp_ns : 0);
    return number;
  }
  /// A call by `port` or by the service itself.
  template <typename Call>
  void ask(const std::string& client, int component, Call&& call) {
    const std::uint32_t question = ++next_question;
    const std::size_t index = asked.size();
    asked.push_back({.client = client, .began = next_tick()});
    const time_ns_t began_ns = seeds::now_ns();
    const auto excuses_ns = [component] {  // an ordinary thread runs where no component does
      return seeds::outcome().stalled_ns + (component == kOutside ? seeds::kept_ns() : 0);
    };
    const time_ns_t excused_ns = excuses_ns();
    Question::Response response{.data = kUntouched};
    const CallOutcome outcome = call(Question::Request{question}, response);
    const time_ns_t now_ns = seeds::now_ns();
    asked[index].ended = next_tick();
    asked[index].outcome = outcome;
    check_call(question, client, component, outcome, response.data, began_ns, now_ns,
               kDataSlack + excuses_ns() - excused_ns);
    findings.count("calls " + std::string(to_string(outcome)));
  }
  template <typename Raise>
  void raise(Raise&& use) {
    ++raises.begun;
    raises.last = next_tick();
    use();
    ++raises.ended;
  }

 private:
  void check_call(std::uint32_t question, const std::string& client, int component, CallOutcome outcome,
                  std::uint32_t data, time_ns_t began_ns, time_ns_t now_ns, time_ns_t slack_ns) {
    const std::string what = "question " + std::to_string(question) + " to " + client + ", " +
                             std::string(to_string(outcome)) + ", ";
    const Answering& answer = answers[question];
    const time_ns_t until_ns = began_ns + call_timeouts[client];
    findings.expect(data == (outcome == CallOutcome::answered ? question + kAnswer : kUntouched),
                    what + "has the response " + std::to_string(data));
    findings.expect(now_ns <= until_ns + slack_ns,
                    what + "took " + std::to_string(now_ns - began_ns) + " ns");
    if (answer.ended_ns != 0 && outcome != CallOutcome::stopped)
      findings.expect(now_ns <= answer.ended_ns + slack_ns,
                      what + "returns " + std::to_string(now_ns - answer.ended_ns) + " ns after its answer");
    switch (outcome) {
      case CallOutcome::answered:
        findings.expect(answer.began_ns != 0, what + "no server has answered it");
        break;
      case CallOutcome::timed_out:
        findings.expect(now_ns >= until_ns, what + "before its time is over");
        findings.expect(answer.ended_ns == 0 || answer.ended_ns >= until_ns,
                        what + "although it was answered");
        break;
      case CallOutcome::stopped:
        findings.expect(stop_asked.contains(component), what + "and no client has stopped the component");
        break;
      case CallOutcome::malformed:
        findings.expect(answer.is_malformed, what + "the answer was well-formed");
        break;
      case CallOutcome::no_server:
      case CallOutcome::busy:
        break;  // looked at when the run is over
    }
  }
};

struct DataShell : Shell {
  Property<std::int64_t>& period_us = property("period_us", 3000, {.structural = ReadBy::fsm});
  ReadPort<Small>& small_in = read_port<Small>("small_in").optional();
  ReadPort<Wide>& wide_in = read_port<Wide>("wide_in").optional();
  ReadPort<Wide>& queue_in = read_port<Wide>("queue_in").optional();
  ReadPort<EventCount>& count_in = read_port<EventCount>("count_in").optional();
  WritePort<Small>& small_out = write_port<Small>("small_out").optional();  // zero when stopped
  WritePort<Wide>& wide_out =
      write_port<Wide>("wide_out", {.on_commit = OutputPolicy::hold, .on_stop = OutputPolicy::hold})
          .optional();
  WritePort<Wide>& queue_out =
      write_port<Wide>("queue_out", {.on_commit = OutputPolicy::hold, .on_stop = OutputPolicy::hold})
          .optional();
  EventPort& raise = event_port("raise").optional();
  CallPort<CallOf<Question>>& ask = call_port<Question>("ask");
};

/// What a component's event wait waits for; nothing: it has none.
enum class Awaited : std::uint8_t { nothing, raise, small, queue };

/// What a component does in its executions.
struct Habits {
  Awaited awaited{Awaited::nothing};  // which it reads in each execution
  bool asks{false};
  bool raises{false};
  bool hogs{false};       // uses the processor for long
  bool is_urgent{false};  // above all others
};
/// The wake-ups and copies of a write that waits for another writer, and one hog on another processor: these share the time.
inline constexpr time_ns_t kLongestWrite = ms_to_ns(46);
inline constexpr time_ns_t kHogs = ms_to_ns(16);

class DataCore : public Core<DataShell> {
 public:
  DataCore(std::shared_ptr<DataShared> shared, int component, int number, Habits habits, std::uint64_t seed)
      : shared_(std::move(shared)), component_(component), number_(number), habits_(habits), dice_(seed) {}

  void act() {
    ++executions_;
    DataShell& ports = shell();
    read_count();
    if (dice_.once_in(2)) write(ports.small_out);
    if (dice_.once_in(2)) read_small();
    if (dice_.once_in(2)) write(ports.wide_out);
    if (dice_.once_in(2)) read(ports.wide_in);
    if (!shared_->is_quiet && dice_.once_in(2)) {
      for (int pushes = 1 + dice_.below(3); pushes > 0; --pushes) write(ports.queue_out);
    }
    read_queue();
    if (habits_.awaited == Awaited::small) read_small();
    if (shared_->is_quiet) return;
    if (habits_.raises && dice_.once_in(3)) shared_->raise([&] { ports.raise.raise(); });
    if (habits_.asks && dice_.once_in(3)) {
      shared_->ask(ports.ask.connected_to().resource, component_,
                   [&](const Question::Request& request, Question::Response& response) {
                     return ports.ask(request, response);
                   });
    }
    seeds::compute(dice_.between(0, us_to_ns(60)));
    if (dice_.once_in(3)) {  // late, where a change is made meanwhile
      if (dice_.once_in(4)) seeds::compute(us_to_ns(800));
      write(ports.small_out);
      write(ports.wide_out);
    }
    if (habits_.hogs && dice_.once_in(12)) seeds::compute(kHogs);
  }
  bool adopt(const CoreBase& /*old*/) override { return true; }
  void take(CoreBase& old) noexcept override { executions_ = static_cast<DataCore&>(old).executions_; }
  std::string description() const override { return "core of component " + std::to_string(component_); }

 private:
  template <typename Value>
  void write(WritePort<Value>& port) {
    ResourceHistory* const history = shared_->history(port);
    if (shared_->is_quiet) return;
    if (history == nullptr) {
      port.write(value_of<Value>(5.0));
      return;
    }
    shared_->write<Value>(*history, clock_ns(), [&](const Value& value) {
      const time_ns_t began_ns = seeds::now_ns() - seeds::outcome().stalled_ns;
      const bool accepted = port.write(value);
      const time_ns_t took_ns = seeds::now_ns() - seeds::outcome().stalled_ns - began_ns;
      shared_->findings.expect(
          !habits_.is_urgent || took_ns <= kLongestWrite,
          "the most urgent component writes to " + history->name + " for " + std::to_string(took_ns) + " ns");
      return std::pair(accepted, shared_->given_up.contains(number_));
    });
  }
  template <typename Value>
  double read(ReadPort<Value>& port) {
    ResourceHistory* const history = shared_->history(port);
    if (history == nullptr) {
      const Sample<Value> sample = port.read();
      shared_->findings.expect(sample.status == DataStatus::none && number_of(sample.value) == 0.0,
                               "an unconnected port of component " + std::to_string(component_) + " reads " +
                                   std::to_string(number_of(sample.value)));
      return 0.0;
    }
    const auto is_valid = [this] { return !shared_->given_up.contains(number_); };
    return shared_->read(*history, is_valid, [&] {
      if (dice_.once_in(2)) {
        Sample<Value> sample = port.read();
        return std::tuple(sample.value, sample.status, sample.time_ns);
      }
      Value value;
      time_ns_t stamp_ns = 0;
      const DataStatus status = port.read(value, &stamp_ns);
      return std::tuple(value, status, stamp_ns);
    });
  }
  void read_small() {
    const double found = read(shell().small_in);
    if (shared_->given_up.contains(number_)) {
      shared_->last_small.erase(component_);  // its ports may be closed
    } else {
      shared_->last_small[component_] = found;
    }
  }
  void read_queue() {
    const bool reads_all = habits_.awaited == Awaited::queue;
    for (int pops = dice_.below(4); reads_all || pops > 0; --pops) {
      if (read(shell().queue_in) == 0.0) return;
    }
  }
  /// The count of raises is never behind what was raised before, and never goes back.
  void read_count() {
    if (shell().count_in.connected_to().resource.empty()) return;
    const Raises& raises = shared_->raises;
    const std::uint64_t least = raises.ended;
    const Sample<EventCount> sample = shell().count_in.read();
    const std::uint64_t found = sample.status == DataStatus::none ? 0 : sample.value.data;
    shared_->findings.expect(found >= least && found <= raises.begun,
                             "component " + std::to_string(component_) + " finds " + std::to_string(found) +
                                 " raises, expected " + std::to_string(least) + " to " +
                                 std::to_string(raises.begun));
    std::uint64_t& last = shared_->last_count[component_];
    shared_->findings.expect(found >= last, "the count of raises goes back from " + std::to_string(last) +
                                                " to " + std::to_string(found));
    last = found;
  }

 protected:
  std::shared_ptr<DataShared> shared_;
  int component_;
  int number_;

 private:
  Habits habits_;
  Dice dice_;
  int executions_{0};
};

struct DataFsm : Fsm<DataShell, DataCore> {
  void define() override {
    State& run = execution("Run", "act", &DataCore::act);
    State& pause = wait("Pause", us_to_ns(shell().period_us.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

inline constexpr time_ns_t kDataApart = us_to_ns(300);

/// act -> wait for a write, as good as for ever -> act
template <Awaited What>
struct DataEventFsm : Fsm<DataShell, DataCore> {
  void define() override {
    State& run = execution("Run", "act", &DataCore::act);
    PortBase& port = What == Awaited::raise   ? static_cast<PortBase&>(shell().count_in)
                     : What == Awaited::small ? static_cast<PortBase&>(shell().small_in)
                                              : static_cast<PortBase&>(shell().queue_in);
    State& pause = wait_event("Pause", port, kForever, kDataApart);
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

inline std::unique_ptr<FsmBase> data_fsm(Awaited awaited) {
  switch (awaited) {
    case Awaited::raise:
      return new_part<FsmBase, DataEventFsm<Awaited::raise>>();
    case Awaited::small:
      return new_part<FsmBase, DataEventFsm<Awaited::small>>();
    case Awaited::queue:
      return new_part<FsmBase, DataEventFsm<Awaited::queue>>();
    case Awaited::nothing:
      break;
  }
  return new_part<FsmBase, DataFsm>();
}

}  // namespace mauve::testing

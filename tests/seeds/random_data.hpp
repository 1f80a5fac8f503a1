// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: components and ordinary threads use resources of all kinds, while the wiring changes.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"

#include "scenario/data_calls.hpp"
#include "scenario/data_outside.hpp"
#include "scenario/data_parts.hpp"

namespace mauve::testing {

class RandomData {
 public:
  RandomData(std::uint64_t seed, seeds::Findings& findings) : dice_(seed), findings_(findings), seed_(seed) {}

  void run() {
    {
      Architecture architecture;
      architecture_ = &architecture;
      declare();
      Deployer deployer(architecture);
      deployer_ = &deployer;
      deployer.deploy();
      DataOutside outside(architecture, *shared_, seed_);
      outside.start();
      sleep_for(dice_.between(ms_to_ns(10), ms_to_ns(25)));  // the epoch is 20 ms ahead
      for (int requests = 2 + dice_.below(14); requests > 0; --requests) {
        sleep_for(dice_.between(0, ms_to_ns(dice_.once_in(4) ? 25 : 4)));
        request();
      }
      if (dice_.once_in(3)) {
        shut_down();
        outside.end();
      } else {
        shared_->is_quiet = true;
        outside.end_writing();
        expect_settled();
        outside.end();
        expect_carried(outside);
        shut_down();
      }
      expect_safe();
      outside.drain();
      check();
    }
    seeds::expect_threads_end(findings_, s_to_ns(1));
  }

 private:
  struct Part {
    std::string name{};
    Habits habits{};
    int core{0};
    std::map<std::string, std::string> wires{};  // port -> resource
    std::uint64_t wired{0};                      // the tick of the last change or command
    bool is_given_up{false};                     // and has no new core yet
    bool was_running{false};                     // at the shutdown
  };

  void expect(bool is_true, const std::string& otherwise) { findings_.expect(is_true, otherwise); }

  // ---- the architecture

  template <typename Kind, typename... Parameters>
  Kind& add(const ResourceHistory& history, Parameters&&... parameters) {
    Kind& resource = architecture_->add_resource<Kind>(history.name, std::forward<Parameters>(parameters)...);
    ResourceHistory& known = shared_->resources[history.name] = history;
    if (known.is_logged) resource.begin_log(1U << 18U);
    return resource;
  }

  void declare() {
    const int count = 2 + dice_.below(5);
    const auto readers = static_cast<std::uint32_t>(count + 1);  // and the extra component
    for (const char* name : {"small0", "small1"})
      add<LatestValue<Small>>(
          {.name = name, .has_one_writer = true, .gets_zeros = true, .is_logged = dice_.once_in(2)}, readers);
    add<LatestValue<Wide>>({.name = "wide0", .has_one_writer = true, .is_logged = dice_.once_in(2)}, readers);
    add<SharedData<Small>>({.name = "shared_small", .gets_zeros = true, .is_logged = dice_.once_in(2)});
    add<SharedData<Wide>>({.name = "shared_wide", .is_logged = dice_.once_in(2)});
    for (int i = 0; i < 3; ++i) {
      const auto capacity = static_cast<std::size_t>(1 + dice_.below(6));
      const bool overwrites = i == 1;
      add<RingBuffer<Wide>>({.name = "queue" + std::to_string(i),
                             .is_ring = true,
                             .is_logged = dice_.once_in(2),
                             .capacity = capacity,
                             .overwrites = overwrites},
                            capacity, overwrites ? WhenFull::overwrite : WhenFull::refuse);
    }
    architecture_->add_resource<EventCounter>("raises");
    shared_->call_timeouts = {{"client0", ms_to_ns(8)}, {"client1", ms_to_ns(150)}};
    for (const auto& [name, timeout_ns] : shared_->call_timeouts)
      architecture_->add_resource<Client<Question>>(name, timeout_ns);
    for (int i = 0; i < count; ++i) add_part(i);
    for (const char* name : {"small0", "shared_wide", "queue2"}) architecture_->publish(name);
    architecture_->configure();
  }

  void add_part(int index) {
    Part part{.name = "c" + std::to_string(index)};
    Awaited awaited = Awaited::nothing;
    if (index != 0 && dice_.once_in(2)) awaited = static_cast<Awaited>(1 + dice_.below(3));
    part.habits = {.awaited = awaited,
                   .asks = dice_.once_in(2),
                   .raises = dice_.once_in(2) && awaited != Awaited::raise,
                   .hogs = index != 0 && awaited == Awaited::nothing && dice_.once_in(6),
                   .is_urgent = index == 0};
    if (part.habits.is_urgent) part.habits.asks = false;
    part.core = next_core_;
    Component& component = architecture_->add_component(
        part.name, new_part<Shell, DataShell>(), core(index, part.habits), data_fsm(part.habits.awaited),
        {.priority = index == 0 ? 80 : 10 + 10 * dice_.below(4)});
    component.set_property("period_us", std::int64_t{500 * (2 + dice_.below(11))});
    // The writing ends of which there is one go to the first components.
    const std::array<std::string, 3> small{"small0", "small1", "shared_small"};
    part.wires = {{"small_out", small[static_cast<std::size_t>(std::min(index, 2))]},
                  {"wide_out", index == 0 ? "wide0" : "shared_wide"},
                  {"queue_out", any_queue()},
                  {"small_in", dice_.one_of(small)},
                  {"wide_in", dice_.once_in(2) ? "wide0" : "shared_wide"},
                  {"queue_in", any_queue()},
                  {"count_in", "raises"},
                  {"raise", "raises"},
                  {"ask", dice_.once_in(2) ? "client0" : "client1"}};
    if (part.habits.awaited == Awaited::small && part.wires["small_in"] == part.wires["small_out"])
      part.wires["small_out"] = "";
    if (part.habits.awaited == Awaited::queue) part.wires["queue_out"] = "";
    if (part.habits.is_urgent && dice_.once_in(2)) std::swap(part.wires["wide_out"], urgent_wide_);
    for (const auto& [port, resource] : part.wires) {
      if (!resource.empty()) architecture_->connect(part.name, port, resource, service(port));
    }
    parts_.push_back(part);
  }
  std::string any_queue() { return "queue" + std::to_string(dice_.below(3)); }
  static std::string service(const std::string& port) {
    if (port.ends_with("_out")) return "write";
    if (port.ends_with("_in")) return "read";
    return port == "ask" ? "call" : port;
  }

  std::unique_ptr<CoreBase> core(int component, Habits habits) {
    const int number = next_core_++;
    return std::make_unique<DataCore>(shared_, component, number, habits,
                                      seed_ * 1000 + static_cast<std::uint64_t>(number));
  }
  // ---- the client

  void request() {
    const int index = dice_.below(static_cast<int>(parts_.size()));
    switch (dice_.below(8)) {
      case 0:
        return stop(index, {.timeout_ns = dice_.between(0, ms_to_ns(60)), .force = dice_.once_in(3)});
      case 1:
      case 2:
        return start(index);
      case 3:
        return change_extra();
      default:
        change();
    }
  }
  template <typename Request>
  bool attempt(const std::string& what, Request&& request) {
    findings_.note(what);
    try {
      request();
    } catch (const Error& error) {
      findings_.note(what + ": refused: " + error.what());
      expect(error.code() != ErrorCode::internal, what + ": internal error: " + error.what());
      return false;
    }
    findings_.note("end of " + what);
    return true;
  }

  void stop(int index, const StopOptions& options) {
    Part& part = parts_[static_cast<std::size_t>(index)];
    const bool was_running = state_of(part) == ComponentState::running;
    shared_->stop_asked.insert(index);
    if (options.force) shared_->given_up.insert(part.core);
    const bool is_stopped = attempt("stop " + part.name + (options.force ? " by force" : ""), [&] {
      if (deployer_->stop(part.name, options)) part.is_given_up = true;
    });
    if (!is_stopped || !was_running) return;
    findings_.count("stops");
    begin_zero(part);
  }
  /// From now on what the component writes to alone is zero.
  void begin_zero(const Part& part) {
    const auto found = shared_->resources.find(part.wires.at("small_out"));
    if (found == shared_->resources.end() || !found->second.has_one_writer) return;
    found->second.zero.emplace_back(next_tick(), UINT64_MAX);
  }
  void end_zeros() {
    for (auto& [name, history] : shared_->resources) {
      if (!history.zero.empty())
        history.zero.back().second = std::min(history.zero.back().second, next_tick());
    }
  }
  void start(int index) {
    Part& part = parts_[static_cast<std::size_t>(index)];
    if (state_of(part) == ComponentState::running) return;
    end_zeros();
    if (part.is_given_up) return change();
    shared_->stop_asked.erase(index);
    attempt("start " + part.name, [&] { deployer_->start(part.name); });
    part.wired = next_tick();
  }
  ComponentState state_of(const Part& part) const {
    return architecture_->component(part.name).task().state();
  }

  /// Exchanges writing ends, connects readers anew, replaces cores.
  void change() {
    end_zeros();
    Transaction transaction;
    std::vector<Part> after = parts_;
    std::string text = "change:";
    const int count = static_cast<int>(parts_.size());
    for (const char* port : {"small_out", "wide_out", "queue_out"}) {
      if (!dice_.once_in(2)) continue;
      std::string& one = after[static_cast<std::size_t>(dice_.below(count))].wires[port];
      std::string& other = after[static_cast<std::size_t>(dice_.below(count))].wires[port];
      std::swap(one, other);
    }
    for (Part& part : after) {
      if (dice_.once_in(4)) part.wires["small_in"] = any_small(part);
      if (dice_.once_in(4)) part.wires["wide_in"] = dice_.once_in(2) ? "wide0" : "shared_wide";
      if (dice_.once_in(6)) part.wires["queue_in"] = any_queue();
    }
    for (std::size_t i = 0; i < after.size(); ++i) {
      if (dice_.once_in(5) || after[i].is_given_up) {
        after[i].core = next_core_;
        transaction.replace_core(after[i].name, core(static_cast<int>(i), after[i].habits));
        text += " core " + std::to_string(after[i].core) + " " + after[i].name;
      }
      for (const auto& [port, resource] : parts_[i].wires) {
        if (resource != after[i].wires[port] && !resource.empty())
          transaction.disconnect(after[i].name, port);
      }
    }
    for (std::size_t i = 0; i < after.size(); ++i) {
      for (const auto& [port, resource] : after[i].wires) {
        if (resource == parts_[i].wires[port]) continue;
        text += " " + after[i].name + "." + port + " " + resource;
        if (!resource.empty()) transaction.connect(after[i].name, port, resource, service(port));
      }
    }
    if (transaction.steps().empty()) return;
    commit(text, std::move(transaction), after);
  }
  std::string any_small(const Part& part) {
    const std::array<std::string, 3> small{"small0", "small1", "shared_small"};
    std::string found = dice_.one_of(small);
    return part.habits.awaited == Awaited::small && found == part.wires.at("small_out")
               ? part.wires.at("small_in")
               : found;
  }

  void commit(const std::string& text, Transaction transaction, const std::vector<Part>& after) {
    const TransactionOptions options{
        .timeouts = {.commit_ns = dice_.once_in(3) ? ms_to_ns(5) : ms_to_ns(400), .phase_ns = 0}};
    std::optional<TransactionReport> report;
    attempt(text, [&] { report = deployer_->commit(std::move(transaction), options); });
    findings_.count(report ? "changes made" : "changes refused");
    if (!report) return;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      for (const auto& [port, resource] : parts_[i].wires) {
        const std::string& other = after[i].wires.at(port);
        if (other == resource || !port.ends_with("_out")) continue;
        for (const std::string& moved : {resource, other}) {
          if (!moved.empty()) note_moved(moved, report->instant_ns);
        }
      }
      const bool has_new_core = after[i].core != parts_[i].core;
      parts_[i] = after[i];
      parts_[i].wired = next_tick();
      if (has_new_core) parts_[i].is_given_up = false;
    }
  }

  /// From T on the resource takes no earlier write of any writer; where no component ran, the kernel reports no T.
  void note_moved(const std::string& resource, time_ns_t instant_ns) {
    shared_->resources[resource].moved.push_back(instant_ns != kNotMeasured ? instant_ns : seeds::now_ns());
  }

  /// Adds a component and a resource that it writes and reads, or removes both.
  void change_extra() {
    end_zeros();
    Transaction transaction;
    if (has_extra_) {
      shared_->stop_asked.insert(kExtra);
      shared_->given_up.insert(extra_core_);  // what it writes while it leaves may be dropped
      transaction.remove_component("extra");
      transaction.remove_resource("extra_wide");
    } else {
      shared_->stop_asked.erase(kExtra);
      extra_core_ = next_core_;
      ResourceHistory& history = shared_->resources["extra_wide"];
      extra_histories_.push_back(std::exchange(history, {.name = "extra_wide", .has_one_writer = true}));
      transaction.add_resource("extra_wide", std::make_unique<LatestValue<Wide>>(2));
      transaction.add_component("extra",
                                Parts{.shell = new_part<Shell, DataShell>(),
                                      .core = core(kExtra, {.asks = true, .raises = true}),
                                      .fsm = new_part<FsmBase, DataFsm>()},
                                {.settings = {.priority = 10 + 10 * dice_.below(4)}});
      transaction.connect("extra", "wide_out", "extra_wide", "write");
      transaction.connect("extra", "wide_in", dice_.once_in(2) ? "wide0" : "extra_wide", "read");
      transaction.connect("extra", "small_in", dice_.once_in(2) ? "small0" : "small1", "read");
      transaction.connect("extra", "small_out", "shared_small", "write");
      transaction.connect("extra", "queue_out", extra_queue_ = any_queue(), "write");
      transaction.connect("extra", "queue_in", any_queue(), "read");
      transaction.connect("extra", "raise", "raises", "raise");
      transaction.connect("extra", "ask", "client0", "call");
      transaction.start("extra");
    }
    time_ns_t instant_ns = kNotMeasured;
    const bool is_made = attempt(has_extra_ ? "remove extra" : "add extra", [&] {
      instant_ns =
          deployer_->commit(std::move(transaction), {.timeouts = {.commit_ns = ms_to_ns(400)}}).instant_ns;
    });
    // The extra component gains writing ends: from then on these ends take no earlier write of any writer.
    if (is_made && !has_extra_) {
      for (const std::string& gained : {std::string("shared_small"), extra_queue_})
        note_moved(gained, instant_ns);
    }
    if (is_made) has_extra_ = !has_extra_;
  }

  void shut_down() {
    for (int i = 0; i <= kExtra; ++i) shared_->stop_asked.insert(i);
    end_zeros();
    for (Part& part : parts_) part.was_running = state_of(part) == ComponentState::running;
    attempt("shutdown", [&] { deployer_->shutdown(); });
  }

  // ---- what must hold

  /// Once nothing is written any more, who waits for a write has seen the last one.
  void expect_settled() {
    pause(ms_to_ns(190));  // a call that has no answer ends after 150 ms
    for (int bursts = 6; bursts > 0 && waits_for_raises(); --bursts) {
      for (int raises = 2 + dice_.below(3); raises > 0; --raises) {
        shared_->raise([this] {
          static_cast<EventCounter&>(architecture_->resource("raises")).raise.raise(monotonic_now_ns());
        });
        if (dice_.once_in(2)) sleep_for(dice_.between(0, us_to_ns(100)));
      }
      pause(ms_to_ns(25));
      expect_raises_seen();
    }
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const Part& part = parts_[i];
      if (state_of(part) != ComponentState::running) continue;
      const auto index = static_cast<int>(i);
      if (part.habits.awaited == Awaited::small) expect_seen(part, index);
      if (part.habits.awaited == Awaited::queue) expect_emptied(part);
    }
  }
  static void pause(time_ns_t length_ns) {
    time_ns_t stalled_ns = -1;
    do {
      stalled_ns = seeds::outcome().stalled_ns;
      sleep_for(length_ns);
    } while (seeds::outcome().stalled_ns > stalled_ns);
  }
  bool waits_for_raises() const {
    return std::ranges::any_of(parts_, [this](const Part& part) {
      return part.habits.awaited == Awaited::raise && state_of(part) == ComponentState::running;
    });
  }
  void expect_raises_seen() {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (parts_[i].habits.awaited != Awaited::raise || state_of(parts_[i]) != ComponentState::running)
        continue;
      const std::uint64_t seen = shared_->last_count[static_cast<int>(i)];
      findings_.count("raises seen");
      expect(seen == shared_->raises.begun, parts_[i].name + " has seen " + std::to_string(seen) +
                                                " raises of " + std::to_string(shared_->raises.begun));
    }
  }
  void expect_seen(const Part& part, int index) {
    const ResourceHistory& history = shared_->resources[part.wires.at("small_in")];
    if (history.writes.empty() || history.writes.back().began < part.wired) return;
    if (!shared_->last_small.contains(index)) return;
    Resource& resource = architecture_->resource(history.name);
    double found = 0.0;
    resource.read_number(resource.find_number("numbers[0]").value(), found);
    findings_.count("event waits settled");
    expect(found == shared_->last_small[index],
           part.name + " waits for writes to " + history.name + ", and has seen " +
               std::to_string(shared_->last_small[index]) + " instead of " + std::to_string(found));
  }
  void expect_emptied(const Part& part) {
    const ResourceHistory& history = shared_->resources[part.wires.at("queue_in")];
    const bool is_told = std::ranges::any_of(
        history.writes, [&](const Use& write) { return write.has_new && write.began > part.wired; });
    if (!is_told) return;
    auto& ring = static_cast<RingBuffer<Wide>&>(architecture_->resource(history.name));
    ReaderState reader;
    Wide value;
    time_ns_t stamp_ns = 0;
    const bool is_empty = ring.read.read(value, stamp_ns, reader) != DataStatus::new_data;
    findings_.count("event waits settled");
    expect(is_empty, part.name + " waits for writes to " + history.name + ", and leaves " +
                         std::to_string(number_of(value)) + " there");
    if (is_empty) return;
    ResourceHistory& changed = shared_->resources[history.name];
    changed.end_read(changed.begin_read(), number_of(value), true, stamp_ns);
  }

  /// What was carried out last is what there is.
  void expect_carried(const DataOutside& outside) {
    for (const auto& [name, carried] : outside.carried()) {
      if (shared_->resources[name].is_ring) continue;
      Resource& resource = architecture_->resource(name);
      double found = 0.0;
      resource.read_number(resource.find_number("numbers[0]").value(), found);
      findings_.count("published values");
      expect(found == carried, "of " + name + " " + std::to_string(carried) +
                                   " was published last, and its value is " + std::to_string(found));
    }
  }

  /// After the shutdown: outputs are zero, and no component is FAULTED that was not given up.
  void expect_safe() {
    for (const Part& part : parts_) {
      if (!part.is_given_up && !shared_->given_up.contains(part.core))
        expect(state_of(part) == ComponentState::stopped,
               part.name + " is in state " + std::to_string(static_cast<int>(state_of(part))));
      const ResourceHistory& history = shared_->resources[part.wires.at("small_out")];
      if (!history.has_one_writer || !part.was_running) continue;
      Resource& resource = architecture_->resource(history.name);
      double found = 0.0;
      resource.read_number(resource.find_number("numbers[0]").value(), found);
      expect(found == 0.0, history.name + " is " + std::to_string(found) + " after the shutdown");
    }
  }

  void check() {
    for (auto& [name, history] : shared_->resources) {
      if (name.empty()) continue;
      DataCheck data(history, findings_);
      data.run();
      if (history.is_ring) check_counts(history, data);
      findings_.count("reads", static_cast<int>(history.reads.size()));
      findings_.count("writes", static_cast<int>(history.writes.size()));
    }
    for (ResourceHistory& history : extra_histories_) DataCheck(history, findings_).run();
    check_calls(*architecture_, *shared_);
  }
  void check_counts(const ResourceHistory& history, const DataCheck& data) {
    const auto lost = static_cast<RingBuffer<Wide>&>(architecture_->resource(history.name)).lost();
    const auto removed = static_cast<std::size_t>(
        std::ranges::count_if(history.reads, [](const Use& use) { return use.has_new; }));
    const auto refused = static_cast<std::size_t>(std::ranges::count_if(
        history.writes, [](const Use& use) { return !use.has_new && use.ended != UINT64_MAX; }));
    if (!history.overwrites)
      expect(lost == refused, history.name + " counts " + std::to_string(lost) +
                                  " lost elements, and refused " + std::to_string(refused));
    const std::size_t overwritten = history.overwrites ? lost : 0;
    expect(removed + overwritten >= data.sure_writes(),
           history.name + " took " + std::to_string(data.sure_writes()) + " elements, gave " +
               std::to_string(removed) + " and overwrote " + std::to_string(overwritten));
    expect(removed + overwritten <= history.writes.size(),
           history.name + " gave or lost more elements than were written");
  }
  static constexpr int kExtra = 100;

  Dice dice_;
  seeds::Findings& findings_;
  std::uint64_t seed_;
  std::shared_ptr<DataShared> shared_{std::make_shared<DataShared>(findings_)};
  Architecture* architecture_{nullptr};
  Deployer* deployer_{nullptr};
  std::vector<Part> parts_;
  std::vector<ResourceHistory> extra_histories_;
  std::string urgent_wide_{"shared_wide"};
  int next_core_{0};
  int extra_core_{0};
  std::string extra_queue_{};
  bool has_extra_{false};
};

inline void random_data(std::uint64_t seed, seeds::Findings& findings) { RandomData(seed, findings).run(); }

}  // namespace mauve::testing

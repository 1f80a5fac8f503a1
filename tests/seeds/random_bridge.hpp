// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: the bridge carries messages and calls of several writers and callers, over a middleware that fails.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/mauve_rt.hpp"

#include "bridge.hpp"
#include "forked_run.hpp"
#include "middleware/middleware.hpp"
#include "scenario/bridge_network.hpp"
#include "scenario/dice.hpp"

namespace mauve::testing {

class RandomBridge {
 public:
  RandomBridge(std::uint64_t seed, seeds::Findings& findings)
      : dice_(seed), findings_(findings), seed_(seed), middleware_(seed + 9, findings) {}

  void run() {
    seeds::switch_often();
    {
      Architecture architecture;
      architecture_ = &architecture;
      declare();
      bridge::Bridge bridge(middleware_.node(), architecture, {.priority = dice_.below(3)});
      bridge_ = &bridge;
      BridgeNetwork network(architecture, middleware_, findings_, seed_);
      network.listen();
      for (const std::string& name : kAll) open(name, network);
      bridge.log().enable(is_logged_);
      attempt("start", [&] { bridge.start(); });
      network.start();
      for (int requests = 4 + dice_.below(10); requests > 0; --requests) {
        sleep_for(dice_.between(0, dice_.once_in(3) ? ms_to_ns(6) : us_to_ns(500)));
        request(network);
      }
      network.end_sending();
      end(network);
      network.unlisten();
    }
    expect(middleware_.entities() == 0,
           std::to_string(middleware_.entities()) + " entities of rcl are left after the end of the bridge");
    seeds::expect_threads_end(findings_, ms_to_ns(100));
  }

 private:
  static constexpr time_ns_t kPrompt =
      ms_to_ns(60);  // a receiver may pause for 50 ms after a wait that failed
  inline static const std::array<std::string, 3> kOut{"latest_out", "ring_out", "over_out"};
  inline static const std::array<std::string, 2> kIn{"latest_in", "ring_in"};
  inline static const std::array<std::string, 7> kAll{"latest_out", "ring_out", "over_out", "latest_in",
                                                      "ring_in",    "client",   "server"};

  void expect(bool is_true, const std::string& otherwise) { findings_.expect(is_true, otherwise); }

  void declare() {
    const auto places = [this] { return static_cast<std::size_t>(1 + dice_.below(6)); };
    architecture_->add_resource<SharedData<Wide>>("latest_out");
    architecture_->add_resource<RingBuffer<Wide>>("ring_out", places(), WhenFull::refuse);
    architecture_->add_resource<RingBuffer<Wide>>("over_out", places(), WhenFull::overwrite);
    architecture_->add_resource<SharedData<Wide>>("latest_in");
    architecture_->add_resource<RingBuffer<Wide>>("ring_in", places(), WhenFull::refuse);
    architecture_->add_resource<Client<Question>>("client", BridgeNetwork::kCallTimeout);
    architecture_->add_resource<BridgeServer>("server");
    for (const std::string& name : kOut) architecture_->publish(name);
    for (const std::string& name : kIn) architecture_->subscribe(name);
    architecture_->configure();
    const auto rarely = [this](int often) { return dice_.once_in(2) ? 0 : often + dice_.below(20); };
    middleware_.failures = {.publish = rarely(3),
                            .blocked_publish = rarely(10),
                            .take = rarely(5),
                            .wait = rarely(30),
                            .send_request = rarely(3),
                            .send_response = rarely(3)};
    for (const std::string& name : kIn) {
      depths_[name] = static_cast<std::size_t>(dice_.once_in(3) ? 300 : 2 + dice_.below(20));
      are_reliable_[name] = dice_.once_in(2);
    }
    for (const std::string& name : kOut) are_reliable_[name] = dice_.once_in(2);
    is_logged_ = dice_.once_in(2);
  }

  // ---- the bindings

  bridge::TopicSettings topic(const std::string& name) {
    return {.resource = name,
            .name = name,
            .type = "seeds/msg/Wide",
            .qos = {.depth = depths_.contains(name) ? depths_[name] : 10,
                    .reliability = are_reliable_[name] ? RMW_QOS_POLICY_RELIABILITY_RELIABLE
                                                       : RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT,
                    .durability = {},
                    .deadline = {},
                    .liveliness_lease_duration = {}}};
  }
  void open(const std::string& name, BridgeNetwork& network) {
    const bridge::CallSettings call{.resource = name, .name = name, .type = "seeds/srv/Question"};
    attempt("open " + name, [&] {
      if (name == "client") {
        bindings_[name] = bridge_->call(call);
      } else if (name == "server") {
        bindings_[name] = bridge_->offer(call, "call");
      } else {
        const bool is_out = std::ranges::find(kOut, name) != kOut.end();
        bindings_[name] = is_out ? bridge_->publish(topic(name)) : bridge_->subscribe(topic(name));
        entities_[bindings_[name]] = {name, middleware_.entity_of(name)};
      }
    });
    if (dice_.once_in(3)) sleep_for(dice_.between(0, us_to_ns(500)));
    attempt("attach " + name, [&] { bridge_->attach({bindings_[name]}); });
    network.are_attached[name] = true;
  }
  void close(const std::string& name, BridgeNetwork& network) {
    network.are_attached[name] = false;
    const std::vector<double> written = network.accepted("ring_out");
    attempt("close " + name, [&] { bridge_->close({bindings_[name]}); });
    bindings_.erase(name);
    if (name != "ring_out") return;
    const std::vector<double> sent = numbers_of(middleware_.published[name]);
    for (const double number : written)
      expect(std::ranges::find(sent, number) != sent.end(),
             "ring_out was closed, and " + text(number) + " was written before and is not sent");
  }

  /// Ends in time, whatever the middleware does.
  template <typename Request>
  void attempt(const std::string& what, Request&& request) {
    const time_ns_t began_ns = seeds::now_ns();
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    findings_.note(what);
    request();
    findings_.note("end of " + what);
    findings_.count(what.substr(0, what.find(' ')));
    const time_ns_t took_ns = seeds::now_ns() - began_ns - (seeds::outcome().stalled_ns - stalled_ns);
    expect(took_ns <= 5 * kPrompt, what + " took " + std::to_string(took_ns / 1000) + " us");
  }

  void request(BridgeNetwork& network) {
    switch (dice_.below(8)) {
      case 0:
      case 1:
        attempt("stop", [&] { bridge_->stop(); });
        sleep_for(dice_.between(0, ms_to_ns(1)));
        return attempt("start", [&] { bridge_->start(); });
      case 2:
      case 3:
      case 4: {
        const std::string name = dice_.one_of(kAll);
        close(name, network);
        sleep_for(dice_.between(0, ms_to_ns(1)));
        return open(name, network);
      }
      case 5:
        return attempt("report", [&] { bridge_->report(); });
      case 6:
        middleware_.has_server = dice_.once_in(2);
        return take_log();
      default: {
        std::set<std::string> silent;
        std::set<std::string> links;
        for (const std::string& name : kIn) {
          if (dice_.once_in(2)) (dice_.once_in(2) ? silent : links).insert(name);
        }
        attempt("listen for silence", [&] { bridge_->listen_for_silence(silent, links); });
      }
    }
  }
  void take_log() {
    for (bridge::LoggedMessage& message : bridge_->log().take())
      logged_[message.topic].push_back(std::move(message.data));
  }

  // ---- the end

  void end(BridgeNetwork& network) {
    const bool is_shut_down = dice_.once_in(5);
    if (is_shut_down) {
      middleware_.shut_down();
      sleep_for(dice_.between(0, ms_to_ns(2)));
    } else {
      middleware_.failures.wait = 0;
      expect_taken();
      if (dice_.once_in(3)) expect_sent_again(network);
      findings_.count("runs to the end");
    }
    attempt("stop", [&] { bridge_->stop(); });
    network.end();
    for (const std::string& name : kOut) check_sent(name, network);
    for (const std::string& name : kOut) check_copies(name, network);
    check_stops(network);
    for (const std::string& name : kIn) check_received(name, network);
    check_report();
    check_log();
    network.check();
    attempt("close", [&] { bridge_->close(); });
  }
  /// Nothing arrives any more: what has arrived is taken soon.
  void expect_taken() {
    for (const std::string& name : kIn)
      expect(comes_true([&] { return middleware_.waits_since_ns(name) == kForever; }, 2 * kPrompt),
             name + ": a message that has arrived is not taken");
    sleep_for(ms_to_ns(1));
  }
  /// Whether that is so within the time, in which the computer does not stall.
  template <typename Condition>
  static bool comes_true(Condition&& is_so, time_ns_t within_ns) {
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    const time_ns_t until_ns = seeds::now_ns() + within_ns;
    while (!is_so() && seeds::now_ns() < until_ns + seeds::outcome().stalled_ns - stalled_ns)
      sleep_for(us_to_ns(200));
    return is_so();
  }

  /// A new publisher sends soon what was written before it was there.
  void expect_sent_again(BridgeNetwork& network) {
    close("latest_out", network);
    open("latest_out", network);
    const std::vector<CarriedMessage>& sent = middleware_.published["latest_out"];
    const std::uint64_t entity = middleware_.entity_of("latest_out");
    const auto is_sent = [&] { return !sent.empty() && sent.back().entity == entity; };
    expect(comes_true(is_sent, kPrompt) || network.next("latest_out") == 0.0,
           "a new publisher of latest_out does not send its value");
  }

  static std::string text(double number) { return std::to_string(static_cast<std::int64_t>(number)); }
  std::vector<double> numbers_of(const std::vector<CarriedMessage>& messages) {
    std::vector<double> numbers;
    for (const CarriedMessage& message : messages) numbers.push_back(number_in_message(message.data));
    return numbers;
  }

  /// All that was written before the stop went out in order; of a newest value the last one.
  void check_sent(const std::string& name, BridgeNetwork& network) {
    const std::vector<CarriedMessage>& sent = middleware_.published[name];
    std::map<int, double> last;  // by source
    std::size_t copies = 0;
    for (std::size_t i = 0; i < sent.size(); ++i) {
      const double number = number_in_message(sent[i].data);
      expect(number > 0.0, name + " sends a torn or malformed message");
      double& before = last[source_of(number)];
      const bool is_again = name == "latest_out" && number == before && i > 0 &&
                            sent[i].entity != sent[i - 1].entity;  // a new publisher
      const bool is_copy = is_copied(name, network, number) && number == before && i > 0 &&
                           sent[i].entity == sent[i - 1].entity && sent[i].data == sent[i - 1].data;
      if (is_copy) ++copies;
      expect(number > before || is_again || is_copy,
             name + " sends " + text(number) + " after " + text(before));
      before = number;
    }
    findings_.count("sent", static_cast<int>(sent.size()));
    const std::vector<double> written = network.accepted(name);
    const double left = network.next(name);
    if (name == "latest_out") {
      if (left != 0.0)
        expect(!sent.empty() && number_in_message(sent.back().data) == left,
               "latest_out has " + text(left) + ", and does not send it");
      return;
    }
    expect(left == 0.0, name + " has not sent " + text(left));
    if (name == "ring_out")
      expect(written.size() == sent.size() - copies,
             "ring_out was written " + std::to_string(written.size()) + " times, and sends " +
                 std::to_string(sent.size() - copies) + " messages");
    const std::vector<double> numbers = numbers_of(sent);
    for (const double number : written) {
      const auto times = std::ranges::count(numbers, number);
      expect(name == "over_out" || times == 1 || (times > 1 && is_copied(name, network, number)),
             name + " does not send " + text(number) + " once");
    }
  }

  /// Whether copies of it may be sent: a stop has written it, or another value of its time or a later one.
  bool is_copied(const std::string& name, const BridgeNetwork& network, double number) {
    return network.time_of(number) <= architecture_->resource(name).stop_ns();
  }
  /// What a stop has written last is sent three times by a publisher that is best effort, by another one until it is acknowledged.
  void check_copies(const std::string& name, const BridgeNetwork& network) {
    std::map<std::uint64_t, std::vector<double>> sent;  // by publisher
    for (const CarriedMessage& message : middleware_.published[name])
      sent[message.entity].push_back(number_in_message(message.data));
    for (const auto& [entity, numbers] : sent) {
      const auto stop = network.stops().find(numbers.back());
      // Of one that was written during a close its own end may cut the copies off.
      if (stop == network.stops().end() || stop->second.entity != entity) continue;
      const auto times = std::ranges::count(numbers, numbers.back());
      findings_.count("last outputs of stops");
      expect(are_reliable_[name] ? times >= 1 && times <= 21 : times == 3,
             name + " sends the output of a stop, " + text(numbers.back()) + ", " + std::to_string(times) +
                 " times");
    }
  }
  /// When a number began to be sent first, and by whom; no entity: never.
  CarriedMessage first_sent(const std::string& name, double number) {
    for (const CarriedMessage& message : middleware_.published[name]) {
      if (number_in_message(message.data) == number) return message;
    }
    return {.entity = 0, .data = {}};
  }
  /// A topic with an output of a stop takes turns with others like it, message by message, and goes before all others: between
  /// two of its messages the same thread sends of another topic one in its turn, and one in the place of a copy. Another
  /// thread may be at one message of each topic; or be at the topic itself, so that the others go first.
  void check_stops(const BridgeNetwork& network) {
    for (const auto& [number, stop] : network.stops()) {
      const CarriedMessage first = first_sent(stop.name, number);
      if (first.entity == 0 || first.entity != stop.entity) continue;
      findings_.count("outputs of stops");
      std::uint64_t free_since = stop.publishes;
      for (const CarriedMessage& message : middleware_.published[stop.name]) {
        if (message.order > first.order) break;
        if (message.order > stop.publishes) check_turns(network, stop.name, free_since, message);
        free_since = std::max(free_since, message.ended);
      }
    }
  }
  void check_turns(const BridgeNetwork& network, const std::string& stopped, std::uint64_t after,
                   const CarriedMessage& before) {
    for (const std::string& name : kOut) {
      if (name == stopped) continue;
      const bool has_turns = std::ranges::any_of(network.stops(), [&](const auto& each) {
        return each.second.name == name && each.second.publishes <= before.order;
      });
      const std::vector<CarriedMessage>& sent = middleware_.published[name];
      int own = 0;
      int others = 0;
      for (std::size_t i = 0; i < sent.size(); ++i) {
        const bool is_copy = i > 0 && sent[i].data == sent[i - 1].data;
        if (is_copy || sent[i].order <= after || sent[i].order >= before.order) continue;
        ++(sent[i].thread == before.thread ? own : others);
      }
      expect(own <= 2 && (has_turns || others <= 1),
             name + " sends " + std::to_string(own) + " and " + std::to_string(others) + " messages, and " +
                 stopped + " has the output of a stop to send, message " + std::to_string(before.order));
    }
  }

  void check_received(const std::string& name, BridgeNetwork& network) {
    double newest = 0.0;
    std::size_t well_formed = 0;
    for (const CarriedMessage& message : middleware_.taken[name]) {
      const double number = number_in_message(message.data);
      if (number <= 0.0) continue;
      newest = number;
      ++well_formed;
    }
    findings_.count("received", static_cast<int>(well_formed));
    if (name == "latest_in") {
      expect(network.next(name) == newest, "latest_in has not the newest message, " + text(newest));
      expect(network.writes(name) == well_formed, "latest_in was written " +
                                                      std::to_string(network.writes(name)) + " times, for " +
                                                      std::to_string(well_formed) + " messages");
    } else {
      network.check_ring_in(numbers_of(middleware_.taken[name]));
    }
  }

  /// The counts of the bindings that are there.
  void check_report() {
    for (const bridge::TopicReport& topic : bridge_->report().topics) {
      const std::uint64_t entity = middleware_.entity_of(topic.resource);
      std::uint64_t good = 0;
      std::uint64_t all = 0;
      const bool is_out = std::ranges::find(kOut, topic.resource) != kOut.end();
      for (const CarriedMessage& message :
           is_out ? middleware_.published[topic.resource] : middleware_.taken[topic.resource]) {
        if (message.entity != entity) continue;
        ++all;
        good += is_out ? message.is_sent : number_in_message(message.data) > 0.0;
      }
      const auto [passed, refused] = topic.counts;
      const bool is_exact = topic.resource != "ring_in";  // that one refuses when it is full, too
      expect(passed + refused == all && (!is_exact || passed == good) && passed <= good,
             topic.resource + " counts " + std::to_string(passed) + " passed and " + std::to_string(refused) +
                 " refused, expected " + std::to_string(good) + " of " + std::to_string(all));
      findings_.count("refused", static_cast<int>(refused));
    }
  }
  void check_log() {
    take_log();
    if (!is_logged_) return expect(logged_.empty(), "messages are logged that nobody asked for");
    expect(bridge_->log().dropped() == 0, "the log has dropped messages");
    for (const auto& [number, of] : entities_) {
      const bool is_out = std::ranges::find(kOut, of.first) != kOut.end();
      std::vector<Bytes> carried;
      for (const CarriedMessage& message :
           is_out ? middleware_.published[of.first] : middleware_.taken[of.first]) {
        if (message.entity == of.second) carried.push_back(message.data);
      }
      expect(carried == logged_[number], of.first + ": the log has " +
                                             std::to_string(logged_[number].size()) +
                                             " messages, expected the " + std::to_string(carried.size()) +
                                             " that were carried, in order");
    }
  }

  Dice dice_;
  seeds::Findings& findings_;
  std::uint64_t seed_;
  Middleware middleware_;
  Architecture* architecture_{nullptr};
  bridge::Bridge* bridge_{nullptr};
  std::map<std::string, std::size_t> depths_;
  std::map<std::string, bool> are_reliable_;
  std::map<std::string, std::size_t> bindings_;  // that are open
  std::map<std::size_t, std::pair<std::string, std::uint64_t>>
      entities_;  // of all bindings: topic and entity
  std::map<std::size_t, std::vector<Bytes>> logged_;
  bool is_logged_{false};
};

inline void random_bridge(std::uint64_t seed, seeds::Findings& findings) {
  RandomBridge(seed, findings).run();
}

}  // namespace mauve::testing

// SPDX-License-Identifier: LGPL-3.0-or-later
// The threads of random_bridge: writers, a reader and callers on the side of the components, and the other end of the network.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/mauve_rt.hpp"

#include "../middleware/middleware.hpp"
#include "dice.hpp"
#include "values.hpp"

namespace mauve::testing {

/// Numbers of one source have the same millions; its later ones are larger.
inline int source_of(double number) { return static_cast<int>(number / 1e6); }

/// kTorn, also of a message that is malformed.
inline double number_in_message(const Bytes& message) {
  const auto value = std::make_unique<Wide>();
  return CdrReader(message).get(*value) ? number_of(*value) : kTorn;
}
template <typename Value>
Bytes message_of(const Value& value) {
  Bytes message;
  CdrWriter(message).put(value);
  return message;
}

/// A resource with a call, offered as a ROS service: it answers, refuses or throws.
class BridgeServer final : public Resource {
 public:
  BridgeServer() : Resource("server", "") { offer(call_); }
  static bool refuses(std::uint32_t question) { return question % 7 < 2; }

 private:
  struct Call final : RequestService<Question> {
    Call() : RequestService("call") {}
    CallOutcome call(const Question::Request& request, Question::Response& response) override {
      seeds::compute(us_to_ns(request.data % 50));
      if (request.data % 7 == 0) return CallOutcome::busy;
      if (request.data % 7 == 1) throw std::runtime_error("as the seed wants");
      response.data = request.data + kAnswer;
      return CallOutcome::answered;
    }
  };
  Call call_;
};

class BridgeNetwork {
 public:
  static constexpr time_ns_t kCallTimeout = ms_to_ns(8);

  BridgeNetwork(Architecture& architecture, Middleware& middleware, seeds::Findings& findings,
                std::uint64_t seed)
      : architecture_(architecture), middleware_(middleware), findings_(findings), seed_(seed) {}

  void listen() {
    for (auto& [name, listener] : listeners_) resource(name).listen(listener);
  }
  void unlisten() {
    for (auto& [name, listener] : listeners_) resource(name).unlisten(listener);
  }
  void start() {
    for (int i = 0; i < 3; ++i) senders_.emplace_back([this, i] { write(i + 1); });
    for (int i = 0; i < 2; ++i) senders_.emplace_back([this, i] { send(i + 1); });
    for (int i = 0; i < 2; ++i) senders_.emplace_back([this, i] { ask(i); });
    others_.emplace_back([this] { serve(); });
    others_.emplace_back([this] { read(); });
  }
  /// From now on nothing is written, sent or asked.
  void end_sending() {
    is_over_ = true;
    for (OrdinaryThread& sender : senders_) sender.join();
  }
  void end() {
    is_ended_ = true;
    for (OrdinaryThread& other : others_) other.join();
    while (const double number = next("ring_in")) ring_in_.push_back(number);
  }

  /// Numbers whose writes were accepted and have ended.
  const std::vector<double>& accepted(const std::string& name) const { return accepted_.at(name); }
  /// Outputs that a stop has written, by their numbers: what was to be seen when it had.
  struct Stop {
    std::string name;
    std::uint64_t publishes;  // that had begun
    std::uint64_t entity;     // the publisher, if it was attached; else 0
  };
  const std::map<double, Stop>& stops() const noexcept { return stops_; }
  /// When a number was written, by the writer's clock.
  time_ns_t time_of(double number) const { return times_.at(number); }
  std::map<std::string, bool> are_attached{};

  /// What a read gives now; 0: nothing.
  double next(const std::string& name) {
    ReaderState reader;
    const auto value = std::make_unique<Wide>();
    time_ns_t stamp_ns = 0;
    auto& service = dynamic_cast<ReadService<Wide>&>(*resource(name).find_service("read"));
    const DataStatus status = service.read(*value, stamp_ns, reader);
    const bool has_value = status == DataStatus::new_data;
    return has_value ? number_of(*value) : 0.0;
  }
  /// Writes to what comes in, that succeeded.
  std::size_t writes(const std::string& name) const { return listeners_.at(name).writes; }

  // ---- when all is over

  /// What was read is what was taken, in order, but for what found no place.
  void check_ring_in(const std::vector<double>& taken) {
    auto at = taken.begin();
    for (const double number : ring_in_) {
      at = std::find(at, taken.end(), number);
      findings_.expect(at != taken.end(), "ring_in gives " + std::to_string(number) + " out of order");
      if (at != taken.end()) ++at;
    }
    findings_.expect(ring_in_.size() == writes("ring_in"),
                     "ring_in was written " + std::to_string(writes("ring_in")) + " times, and gives " +
                         std::to_string(ring_in_.size()) + " elements");
  }
  /// Each request has the answer to it, and one alone.
  void check() {
    std::map<std::int64_t, int> answers;
    for (const SentResponse& response : middleware_.responses) {
      Question::Response found;
      const std::uint32_t asked = asked_[response.sequence];
      findings_.expect(CdrReader(response.data).get(found) && found.data == asked + kAnswer,
                       "the service answers " + std::to_string(found.data) + " to " + std::to_string(asked));
      ++answers[response.sequence];
    }
    for (const auto& [sequence, is_lost] : middleware_.taken_requests) {
      const std::uint32_t asked = asked_[sequence];
      const int expected = is_lost || asked == 0 || BridgeServer::refuses(asked) ? 0 : 1;
      findings_.expect(answers[sequence] == expected, "the service has answered request " +
                                                          std::to_string(asked) + " " +
                                                          std::to_string(answers[sequence]) +
                                                          " times, expected " + std::to_string(expected));
    }
    findings_.count("services answered", static_cast<int>(middleware_.responses.size()));
  }

 private:
  /// Of a resource to which the bridge writes.
  struct Listener final : EventListener {
    Listener(const char* of, BridgeNetwork& owner) : topic(of), network(owner) {}
    void on_event(time_ns_t /*time_ns*/) noexcept override { ++writes; }
    void on_arrival(time_ns_t /*time_ns*/) noexcept override { network.findings_.count("arrivals"); }
    void on_caught_up(time_ns_t until_ns) noexcept override {
      if (until_ns == kForever) return;
      const time_ns_t since_ns = network.middleware_.waits_since_ns(topic);
      network.findings_.count("silences");
      network.findings_.expect(since_ns >= until_ns, std::string(topic) + ": is said to be written up to " +
                                                         std::to_string(until_ns) +
                                                         ", and a message waits since " +
                                                         std::to_string(since_ns));
    }
    const char* topic;
    BridgeNetwork& network;
    std::size_t writes{0};
  };

  Resource& resource(const std::string& name) { return architecture_.resource(name); }
  static void pause(Dice& dice) {
    if (dice.once_in(2)) return;
    sleep_for(dice.between(0, dice.once_in(2) ? us_to_ns(60) : ms_to_ns(2)));
  }

  // ---- the side of the components

  void write(int source) {
    Dice dice(seed_ + 100 + static_cast<std::uint64_t>(source));
    for (double number = source * 1e6 + 1; number < source * 1e6 + 60 && !is_over_; ++number) {
      pause(dice);
      const std::string name = dice.one_of(std::array<std::string, 3>{"latest_out", "ring_out", "over_out"});
      auto& service = dynamic_cast<WriteService<Wide>&>(*resource(name).find_service("write"));
      const time_ns_t now_ns = monotonic_now_ns();
      times_[number] = now_ns;
      const bool is_stop = dice.once_in(6);
      if (is_stop) resource(name).begin_stop(now_ns);
      const bool is_accepted = service.write(value_of<Wide>(number), now_ns);
      if (is_accepted) accepted_[name].push_back(number);
      if (!is_stop) continue;
      const std::uint64_t entity = are_attached[name] ? middleware_.entity_of(name) : 0;
      resource(name).end_stop();
      stops_[number] = {.name = name, .publishes = middleware_.publishes, .entity = entity};
    }
  }
  void read() {
    Dice dice(seed_ + 200);
    std::map<int, double> last;
    while (!is_ended_) {
      sleep_for(dice.between(0, dice.once_in(4) ? ms_to_ns(3) : us_to_ns(200)));
      if (const double number = next("ring_in"); number != 0.0) {
        findings_.expect(number > 0.0, "ring_in gives a torn value");
        ring_in_.push_back(number);
      }
      if (const double number = next("latest_in"); number != 0.0)
        findings_.expect(number > 0.0, "latest_in gives a torn value");
    }
  }
  void ask(int caller) {
    Dice dice(seed_ + 300 + static_cast<std::uint64_t>(caller));
    auto& client = static_cast<Client<Question>&>(resource("client"));
    for (int calls = 20; calls > 0 && !is_over_; --calls) {
      pause(dice);
      const std::uint32_t question = ++last_question_;
      const time_ns_t began_ns = seeds::now_ns();
      const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
      Question::Response response{.data = 77};
      const CallOutcome outcome = client.call.call({question}, response);
      const time_ns_t took_ns = seeds::now_ns() - began_ns;
      const std::string what = "question " + std::to_string(question) + ", " +
                               std::string(to_string(outcome)) + ", has the response " +
                               std::to_string(response.data);
      const bool is_answered = outcome == CallOutcome::answered;
      findings_.expect(response.data == (is_answered ? question + kAnswer : 77), what);
      findings_.expect(!is_answered || answered_[question], what + ", and no server has answered it");
      findings_.expect(outcome != CallOutcome::timed_out || took_ns >= kCallTimeout,
                       what + " before its time is over");
      findings_.expect(took_ns <= kCallTimeout + ms_to_ns(20) + seeds::outcome().stalled_ns - stalled_ns,
                       what + " after " + std::to_string(took_ns) + " ns");
      findings_.count("calls " + std::string(to_string(outcome)));
      if (outcome == CallOutcome::busy) sleep_for(dice.between(0, ms_to_ns(4)));
    }
  }

  // ---- the other end of the network

  /// Messages that are lost, late, double or malformed; and requests.
  void send(int source) {
    Dice dice(seed_ + 400 + static_cast<std::uint64_t>(source));
    std::vector<std::pair<std::string, Bytes>> late;
    int burst = 0;
    for (double number = source * 1e6 + 1; number < source * 1e6 + 400 && !is_over_; ++number) {
      if (burst > 0) {
        --burst;
      } else {
        pause(dice);
        if (dice.once_in(40)) burst = dice.below(250);
      }
      const std::string topic = dice.once_in(3) || burst > 0 ? "ring_in" : "latest_in";
      Bytes message = message_of(value_of<Wide>(number));
      if (dice.once_in(12)) message.resize(static_cast<std::size_t>(dice.below(100)));
      if (dice.once_in(8)) continue;
      if (dice.once_in(8)) {
        late.emplace_back(topic, message);
        continue;
      }
      middleware_.deliver(topic, message);
      if (dice.once_in(8)) middleware_.deliver(topic, message);
      if (!late.empty() && dice.once_in(3)) {
        middleware_.deliver(late.back().first, late.back().second);
        late.pop_back();
      }
      if (dice.once_in(5)) send_request(dice);
      if (dice.once_in(20))
        middleware_.trouble(dice.one_of(std::array<std::string, 2>{"latest_in", "ring_out"}));
    }
  }
  void send_request(Dice& dice) {
    const bool is_malformed = dice.once_in(10);
    const std::uint32_t question = ++last_question_;
    const std::int64_t sequence =
        middleware_.request("server", is_malformed ? Bytes() : message_of(Question::Request{question}));
    if (sequence != 0) asked_[sequence] = is_malformed ? 0 : question;
  }
  /// Answers calls: some never, late, twice or malformed.
  void serve() {
    Dice dice(seed_ + 500);
    std::vector<std::pair<time_ns_t, SentRequest>> due;
    for (std::size_t seen = 0; !is_ended_;) {
      for (; seen < middleware_.requests.size(); ++seen) {
        const SentRequest& request = middleware_.requests[seen];
        if (dice.once_in(8)) continue;
        const time_ns_t delay_ns = dice.once_in(4) ? dice.between(0, ms_to_ns(12)) : 0;
        due.emplace_back(seeds::now_ns() + delay_ns, request);
        if (dice.once_in(6))
          due.emplace_back(seeds::now_ns() + delay_ns + us_to_ns(dice.below(9'000)), request);
      }
      for (std::size_t i = 0; i < due.size();) {
        if (due[i].first > seeds::now_ns()) {
          ++i;
          continue;
        }
        const SentRequest request = due[i].second;
        due.erase(due.begin() + static_cast<std::ptrdiff_t>(i));
        answer(request, dice);
      }
      sleep_for(dice.between(0, us_to_ns(100)));
    }
  }
  void answer(const SentRequest& request, Dice& dice) {
    Question::Request question;
    findings_.expect(CdrReader(request.data).get(question), "a request is malformed");
    if (dice.once_in(15)) return middleware_.respond(request, {});
    answered_[question.data] = true;
    middleware_.respond(request, message_of(Question::Response{question.data + kAnswer}));
  }

  Architecture& architecture_;
  Middleware& middleware_;
  seeds::Findings& findings_;
  std::uint64_t seed_;
  std::vector<OrdinaryThread> senders_, others_;
  bool is_over_{false};
  bool is_ended_{false};
  std::map<std::string, std::vector<double>> accepted_{
      {"latest_out", {}}, {"ring_out", {}}, {"over_out", {}}};
  std::map<double, time_ns_t> times_;
  std::map<double, Stop> stops_;
  std::vector<double> ring_in_;
  std::uint32_t last_question_{0};
  std::map<std::uint32_t, bool> answered_;       // calls, by question
  std::map<std::int64_t, std::uint32_t> asked_;  // of the service, by sequence number; 0: malformed
  Listener latest_in_{"latest_in", *this}, ring_in_listener_{"ring_in", *this};
  std::map<std::string, Listener&> listeners_{{"latest_in", latest_in_}, {"ring_in", ring_in_listener_}};
};

}  // namespace mauve::testing

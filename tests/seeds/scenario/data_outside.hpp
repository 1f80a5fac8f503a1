// SPDX-License-Identifier: LGPL-3.0-or-later
// The ordinary threads of random_data: one that carries values and calls out, and two that use resources without a port.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"

#include "data_parts.hpp"

namespace mauve::testing {

class DataOutside {
 public:
  DataOutside(Architecture& architecture, DataShared& shared, std::uint64_t seed)
      : architecture_(architecture), shared_(shared), seed_(seed) {
    for (auto& [name, history] : shared.resources) {
      if (!name.empty() && name != "extra_wide") names_.push_back(name);
    }
    for (const auto& [name, timeout_ns] : shared.call_timeouts) client(name).set_connected(true);
  }

  void start() {
    carrier_ = OrdinaryThread([this] { carry(); });
    for (std::size_t i = 0; i < users_.size(); ++i)
      users_[i] = OrdinaryThread([this, i] { use(seed_ + 177 * (i + 1)); });
  }
  void end_writing() {
    is_over_ = true;
    for (OrdinaryThread& user : users_) {
      if (user.joinable()) user.join();
    }
  }
  void end() {
    end_writing();
    is_carried_ = true;
    architecture_.publications().notify();
    carrier_.join();
  }
  /// Of each published resource the number that was carried out last.
  const std::map<std::string, double>& carried() const noexcept { return carried_; }

  /// After the end of all: removes what is left in rings, and takes the logs.
  void drain() {
    for (const std::string& name : names_) {
      ResourceHistory& history = shared_.resources[name];
      if (history.is_ring) {
        while (read(name, false) != 0.0) {
        }
      }
      take_log(history);
      history.is_logged = history.is_logged && resource(name).lost_writes() == 0;
    }
  }

 private:
  Resource& resource(const std::string& name) { return architecture_.resource(name); }
  Client<Question>& client(const std::string& name) { return static_cast<Client<Question>&>(resource(name)); }
  static bool is_wide(const std::string& name) { return name.find("small") == std::string::npos; }

  // ---- the carrier

  struct Pending {
    std::string client;
    std::uint32_t number, question;
    time_ns_t due_ns;
  };

  void carry() {
    Dice dice(seed_ + 99);
    while (!is_carried_) {
      const std::uint32_t word = architecture_.publications().word();
      carry_published();
      for (const auto& [name, timeout_ns] : shared_.call_timeouts) take_requests(name, dice);
      time_ns_t until_ns = give_answers(dice);
      if (dice.once_in(40)) disconnect(dice);
      if (!is_carried_) architecture_.publications().wait(word, until_ns);
    }
    carry_published();
  }
  void carry_published() {
    std::string name;
    std::vector<std::byte> message;
    for (;;) {
      const std::uint64_t began = next_tick();
      time_ns_t stamp_ns = 0;
      message.clear();
      if (!architecture_.next_published(name, message, stamp_ns)) return;
      const double number = is_wide(name) ? number_in<Wide>(message) : number_in<Small>(message);
      ResourceHistory& history = shared_.resources[name];
      history.reads.push_back({.began = began});
      history.end_read(history.reads.size() - 1, number, number != 0.0, stamp_ns);
      carried_[name] = number;
    }
  }
  template <typename Value>
  double number_in(const std::vector<std::byte>& message) {
    const auto value = std::make_unique<Value>();
    shared_.findings.expect(CdrReader(message).get(*value), "a published message is malformed");
    return number_of(*value);
  }
  void take_requests(const std::string& name, Dice& dice) {
    std::vector<std::byte> message;
    for (std::uint32_t number = 0; client(name).next_request(message, number); message.clear()) {
      Question::Request request;
      shared_.findings.expect(CdrReader(message).get(request), "a request is malformed");
      if (dice.once_in(10)) continue;  // it has no answer, ever
      const time_ns_t longest_ns = dice.once_in(4) ? ms_to_ns(20) : us_to_ns(700);
      const time_ns_t delay_ns = dice.once_in(2) ? 0 : dice.between(0, longest_ns);
      pending_.push_back(
          {.client = name, .number = number, .question = request.data, .due_ns = seeds::now_ns() + delay_ns});
      if (dice.once_in(8)) pending_.push_back(pending_.back());  // it is answered twice
    }
  }
  /// The instant of the next one.
  time_ns_t give_answers(Dice& dice) {
    time_ns_t next_ns = kForever;
    for (std::size_t i = 0; i < pending_.size();) {
      if (pending_[i].due_ns > seeds::now_ns()) {
        next_ns = std::min(next_ns, pending_[i++].due_ns);
        continue;
      }
      const Pending one = pending_[i];
      pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(i));
      Answering& answer = shared_.answers[one.question];
      if (answer.began_ns == 0) answer.began_ns = seeds::now_ns();
      if (dice.once_in(15)) {
        answer.is_malformed = true;
        client(one.client).answer(one.number, {});
      } else {
        std::vector<std::byte> message;
        CdrWriter(message).put(Question::Response{one.question + kAnswer});
        client(one.client).answer(one.number, message);
      }
      if (answer.ended_ns == 0) answer.ended_ns = seeds::now_ns();
    }
    return next_ns;
  }
  void disconnect(Dice& dice) {
    ClientBase& chosen = client(dice.once_in(2) ? "client0" : "client1");
    chosen.set_connected(false);
    sleep_for(dice.between(0, us_to_ns(300)));
    chosen.set_connected(true);
  }

  // ---- a user of resources without a port

  void use(std::uint64_t seed) {
    Dice dice(seed);
    std::string name;
    int left = 0;  // of a burst on one resource
    while (!is_over_) {
      if (--left < 0) {
        left = dice.below(12);
        name = names_[static_cast<std::size_t>(dice.below(static_cast<int>(names_.size())))];
        sleep_for(dice.between(0, ms_to_ns(dice.once_in(3) ? 12 : 2)));
      } else if (dice.once_in(2)) {
        sleep_for(dice.between(0, us_to_ns(100)));
      }
      switch (dice.below(12)) {
        case 0:
        case 1:
        case 2:
        case 3:
        case 4:
        case 5:
          write(name, dice.once_in(3));
          break;
        case 6:
          shared_.raise(
              [this] { static_cast<EventCounter&>(resource("raises")).raise.raise(monotonic_now_ns()); });
          break;
        case 7:
          take_log(shared_.resources[name]);
          break;
        case 8:
          if (dice.once_in(2)) ask(dice.once_in(2) ? "client0" : "client1");
          break;
        default:
          read(name, dice.once_in(2));
      }
    }
  }
  void ask(const std::string& name) {
    shared_.ask(name, kOutside, [&](const Question::Request& request, Question::Response& response) {
      return client(name).call.call(request, response);
    });
  }
  /// Not the resources to which one component alone writes.
  void write(const std::string& name, bool as_message) {
    if (shared_.resources[name].has_one_writer) return;
    if (shared_.resources[name].is_ring) {
      write<Wide>(name, static_cast<RingBuffer<Wide>&>(resource(name)).write, as_message);
    } else if (is_wide(name)) {
      write<Wide>(name, static_cast<SharedData<Wide>&>(resource(name)).write, as_message);
    } else {
      write<Small>(name, static_cast<SharedData<Small>&>(resource(name)).write, as_message);
    }
  }
  template <typename Value>
  void write(const std::string& name, WriteService<Value>& service, bool as_message) {
    const time_ns_t stamp_ns = monotonic_now_ns();
    shared_.write<Value>(shared_.resources[name], stamp_ns, [&](const Value& value) {
      if (!as_message) return std::pair(service.write(value, stamp_ns), false);
      std::vector<std::byte> message;
      CdrWriter(message).put(value);
      return std::pair(resource(name).write_sample(message, stamp_ns), false);
    });
  }
  double read(const std::string& name, bool as_number) {
    ResourceHistory& history = shared_.resources[name];
    if (!history.is_ring && as_number) return look(history);
    if (is_wide(name)) return read<Wide>(history);
    return read<Small>(history);
  }
  template <typename Value>
  double read(ResourceHistory& history) {
    auto& service = dynamic_cast<ReadService<Value>&>(*resource(history.name).find_service("read"));
    return shared_.read(history, [&] {
      ReaderState reader;
      Value value;
      time_ns_t stamp_ns = 0;
      const DataStatus status = service.read(value, stamp_ns, reader);
      return std::tuple(value, status, stamp_ns);
    });
  }
  /// Of any one field.
  double look(ResourceHistory& history) {
    const std::size_t field = history.reads.size() % 4;
    const NumberPlace place =
        resource(history.name).find_number("numbers[" + std::to_string(field) + "]").value();
    const std::size_t index = history.begin_read();
    history.reads[index].is_late_look = true;
    double found = 0.0;
    resource(history.name).read_number(place, found);
    found /= static_cast<double>(field + 1);
    history.end_read(index, found, false, 0);
    return found;
  }
  void take_log(ResourceHistory& history) {
    if (!history.is_logged) return;
    const LockGuard lock(log_mutex_);
    std::vector<std::byte> message;
    time_ns_t stamp_ns = 0;
    for (; resource(history.name).next_write(message, stamp_ns); message.clear()) {
      const double number = is_wide(history.name) ? number_in<Wide>(message) : number_in<Small>(message);
      if (number != 0.0) history.log.push_back(number);
    }
  }

  Architecture& architecture_;
  DataShared& shared_;
  std::uint64_t seed_;
  std::vector<std::string> names_;
  std::vector<Pending> pending_;
  std::map<std::string, double> carried_;
  OrdinaryThread carrier_;
  std::array<OrdinaryThread, 2> users_;
  bool is_over_{false};
  bool is_carried_{false};
  Mutex log_mutex_;  // one thread at a time takes what was logged
};

}  // namespace mauve::testing

// SPDX-License-Identifier: LGPL-3.0-or-later
// Sporadic task, polling server and deferrable server: fsms that serve requests with a demand that the timing analysis bounds.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/parts/fsm.hpp"
#include "mauve_rt/parts/shell.hpp"

namespace mauve {

/// The shell of a component that serves requests. Connect `requests` to a ring_buffer: a resource that holds one value has the
/// newest request only. Derive from it for more ports.
template <Described T>
struct ServerShell : Shell {
  using Request = T;

  Property<std::int64_t>& period_us = property(
      "period_us", 10'000,
      {.unit = "us",
       .description =
           "after which the budget comes back; of a sporadic fsm the least time between two requests",
       .minimum = 1,
       .maximum = 3.6e9,
       .structural = ReadBy::fsm});
  Property<std::int64_t>& budget = property("budget", 1,
                                            {.description = "requests that a server serves in a period",
                                             .minimum = 1,
                                             .maximum = 64,
                                             .structural = ReadBy::fsm});
  Property<std::int64_t>& polls =
      property("polls", 10,
               {.description = "how often a deferrable server looks for requests in a period",
                .minimum = 1,
                .maximum = 64,
                .structural = ReadBy::fsm});
  Property<std::int64_t>& wcet_us =
      property("wcet_us", 0,
               {.unit = "us",
                .description = "worst-case execution time of one request, taking it included, for the timing "
                               "analysis; 0: not declared",
                .minimum = 0,
                .maximum = 3.6e9,
                .structural = ReadBy::fsm});
  ReadPort<T>& requests = this->template read_port<T>("requests");
};

/// A core that serves one request at a time:
///
///   using LogShell = mauve::ServerShell<Point>;
///   struct Log : mauve::ServerCore<LogShell> {
///     void serve() override { points_.add(request()); }
///   };
///   architecture.add_component<LogShell, Log, mauve::PollingServerFsm<LogShell>>("log");
template <typename ShellType>
class ServerCore : public Core<ShellType> {
 public:
  /// Takes the next request; false when none waits. [rt]
  bool take_request() MAUVE_RT { return this->shell().requests.read(request_) == DataStatus::new_data; }
  /// Called once for each request. [rt] as far as the core is.
  virtual void serve() = 0;

 protected:
  using Request = typename ShellType::Request;

  /// The request to serve. [rt]
  const Request& request() const MAUVE_RT { return request_; }

  bool configure_hook() override {
    request_ = this->shell().requests.prototype();  // with memory for its sequences
    return true;
  }

 private:
  Request request_{};
};

/// What the fsms below share. They run any core with the methods `take_request` and `serve`.
template <typename ShellType, typename CoreType>
class ServerFsm : public Fsm<ShellType, CoreType> {
 protected:
  /// A state that serves one request. [setup]
  State& serving(std::string name) {
    State& state = this->execution(std::move(name), "serve", &CoreType::serve);
    state.wcet_ns = us_to_ns(this->shell().wcet_us);
    return state;
  }
  /// A wait for a request, which then goes to `served`. It also ends, once, for requests that another state has taken since; then it
  /// waits for the next one, and for a hundredth of the period at least: the analysis follows each release. [setup]
  State& awaiting(State& served) {
    State& state = this->wait_event("AwaitRequest", this->shell().requests, kForever,
                                    us_to_ns(this->shell().period_us) / 100);
    take(state, served, state);
    return state;
  }
  /// Takes a request after a state: with one it goes on to `served`, without one to `idle`. Taking a request is part of its
  /// time, so the wait itself takes the least that can be declared. [setup]
  void take(State& after, State& served, State& idle) {
    if (after.is_wait && this->shell().wcet_us > 0) after.wcet_ns = 1;
    this->transition(after, "take_request", &CoreType::take_request, served);
    this->next(after, idle);
  }
};

/// A sporadic task (Mok 1983): serves each request when it comes, and `period_us` after the one before at the earliest.
template <typename ShellType, typename CoreType = ServerCore<ShellType>>
class SporadicFsm : public ServerFsm<ShellType, CoreType> {
 protected:
  void define() override {
    State& serve = this->serving("Serve");
    State& apart = this->wait("KeepApart", mauve::times(1, this->shell().period_us));
    this->set_initial(apart);  // a request from before the start has no event
    this->next(serve, apart);
    this->take(apart, serve, this->awaiting(serve));
  }
};

/// A polling server (Lehoczky, Sha, Strosnider 1987): in each period serves the requests that wait, `budget` at most. What remains of
/// the budget when none waits is lost. Its component is periodic.
template <typename ShellType, typename CoreType = ServerCore<ShellType>>
class PollingServerFsm : public ServerFsm<ShellType, CoreType> {
 protected:
  void define() override {
    State& poll = this->wait("Poll", mauve::times(1, this->shell().period_us));
    this->set_initial(poll);
    State* before = &poll;
    for (std::int64_t number = 1; number <= this->shell().budget; ++number) {
      State& serve = this->serving("Serve_" + std::to_string(number));
      this->take(*before, serve, poll);
      before = &serve;
    }
    this->next(*before, poll);
  }
};

/// A deferrable server (Strosnider, Lehoczky, Sha 1995): while it has budget it serves a request when it comes. A period begins with
/// the first request, or where the last period ends if a request waits there; the whole budget comes back with it.
///
/// A wait of an fsm has a fixed length. So within a period the server looks for further requests at `polls` instants.
template <typename ShellType, typename CoreType = ServerCore<ShellType>>
class DeferrableServerFsm : public ServerFsm<ShellType, CoreType> {
 protected:
  void define() override {
    polls_ = static_cast<std::size_t>(this->shell().polls.value());
    const auto budget = static_cast<std::size_t>(this->shell().budget.value());
    std::vector<State*> ends;  // from a poll to the end of the period
    ends.reserve(polls_);
    for (std::size_t poll = 0; poll < polls_; ++poll)
      ends.push_back(&this->wait("Period_" + std::to_string(poll), between(poll, polls_)));
    this->set_initial(*ends.back());  // a request from before the start has no event

    // waits[poll][used]: from a poll to the next one with so much of the budget used; serves[poll][number]: the number-th request.
    std::vector<std::vector<State*>> waits(polls_, std::vector<State*>(budget + 1));
    auto serves = waits;
    for (std::size_t poll = 0; poll < polls_; ++poll) {
      for (std::size_t number = 1; number <= budget; ++number) {
        const std::string name = "_" + std::to_string(poll) + "_" + std::to_string(number);
        const bool is_last = poll + 1 == polls_ || number == budget;
        waits[poll][number] = is_last ? ends[poll] : &this->wait("Used" + name, between(poll, poll + 1));
        if (poll == 0 || number > 1) serves[poll][number] = &this->serving("Serve" + name);
      }
    }
    for (std::size_t poll = 0; poll < polls_; ++poll) {
      for (std::size_t number = 1; number <= budget; ++number) {
        State* const serve = serves[poll][number];
        if (serve != nullptr && number < budget) {
          this->take(*serve, *serves[poll][number + 1], *waits[poll][number]);
        } else if (serve != nullptr) {
          this->next(*serve, *ends[poll]);
        }
        if (number < budget && poll + 1 < polls_)
          this->take(*waits[poll][number], *serves[poll + 1][number + 1], *waits[poll + 1][number]);
      }
    }
    State& await = this->awaiting(*serves[0][1]);
    for (State* const end : ends) this->take(*end, *serves[0][1], await);
  }

 private:
  /// From one poll of a period to another. [setup]
  time_ns_t between(std::size_t from, std::size_t to) const {
    const time_ns_t period_ns = us_to_ns(this->shell().period_us);
    const auto at_ns = [&](std::size_t poll) {
      return period_ns * static_cast<time_ns_t>(poll) / static_cast<time_ns_t>(polls_);
    };
    return at_ns(to) - at_ns(from);
  }

  std::size_t polls_{1};
};

}  // namespace mauve

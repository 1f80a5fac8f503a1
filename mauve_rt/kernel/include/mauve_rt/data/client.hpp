// SPDX-License-Identifier: LGPL-3.0-or-later
// Client: a resource whose calls somebody outside of the architecture answers, a ROS service as a rule.
#pragma once

#include <cstdint>
#include <memory>

#include "mauve_rt/base/function_ref.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/data/call_type.hpp"
#include "mauve_rt/data/resource.hpp"
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

class Waiter;

inline constexpr time_ns_t kDefaultCallTimeout = ms_to_ns(100);

/// How the calls of a client ended so far.
struct CallCounts {
  std::uint64_t answered{0};
  std::uint64_t no_server{0};
  std::uint64_t timed_out{0};
  std::uint64_t other{0};   // busy, malformed, stopped
  time_ns_t longest_ns{0};  // of the calls that were answered
};

/// A client seen without its type: one call at a time, whose caller sleeps until it is answered or its time is over.
///
/// | member           | written by             | read by             | under / order                               |
/// | ---------------- | ---------------------- | ------------------- | ------------------------------------------- |
/// | number_, caller_ | the calling component  | who answers         | mutex_                                      |
/// | is_posted_ ...   | both                   | both                | mutex_                                      |
/// | ended_ (futex)   | who answers, caller    | the caller          | release/acquire: publishes outcome_         |
/// | is_connected_    | who carries the calls  | callers             | relaxed: a call may just miss it either way |
class ClientBase : public Resource {
 public:
  /// No call takes longer than `timeout_ns` (> 0; else Error: out_of_range).
  ClientBase(std::string type, time_ns_t timeout_ns);

  /// [rt]
  time_ns_t timeout_ns() const MAUVE_RT { return timeout_ns_; }
  ClientBase* client() noexcept override { return this; }
  void set_name(const std::string& name) override;
  /// [non-rt]
  CallCounts counts() const;

  // The side of who carries the calls; one thread takes requests, any may answer.

  /// Whether there is anybody who does; else each call ends at once with no_server. [non-rt]
  void set_connected(bool connected) noexcept { is_connected_.store(connected, std::memory_order_relaxed); }
  /// The request to be sent, once each; false: none. [non-rt]
  virtual bool next_request(std::vector<std::byte>& message, std::uint32_t& number) = 0;
  /// Ends the call of that number; nothing happens when nobody waits for it any more. [non-rt]
  virtual void answer(std::uint32_t number, std::span<const std::byte> message) = 0;
  void refuse(std::uint32_t number, CallOutcome outcome);

 protected:
  /// One call: `put` writes the request, `get` copies the response, both under the mutex. [rt]
  CallOutcome call(FunctionRef<void()> put, FunctionRef<void()> get) MAUVE_RT;
  /// `get` copies the request under the mutex; false when there is none. [non-rt]
  bool take_request(std::uint32_t& number, FunctionRef<void()> get);
  /// `put` writes the response under the mutex, if the call still waits. [non-rt]
  void end(std::uint32_t number, CallOutcome outcome, FunctionRef<void()> put);

 private:
  void await(std::uint32_t number, time_ns_t until_ns, Waiter* caller) const noexcept;
  void count(CallOutcome outcome, time_ns_t lasted_ns) noexcept MAUVE_REQUIRES(mutex_);

  const time_ns_t timeout_ns_;
  mutable PiMutex mutex_;
  std::uint32_t number_ MAUVE_GUARDED_BY(mutex_){0};
  bool is_posted_ MAUVE_GUARDED_BY(mutex_){false};    // a request that was not taken yet
  bool is_waiting_ MAUVE_GUARDED_BY(mutex_){false};   // a call is under way
  Waiter* caller_ MAUVE_GUARDED_BY(mutex_){nullptr};  // nullptr: a thread that is no component's
  CallOutcome outcome_ MAUVE_GUARDED_BY(mutex_){CallOutcome::answered};
  CallCounts counts_ MAUVE_GUARDED_BY(mutex_);
  Atomic<std::uint32_t> ended_{0};  // the number of the last call that ended
  Atomic<bool> is_connected_{false};
};

/// Offers the service `call` of the type.
template <DescribedCall S>
class Client final : public ClientBase {
 public:
  using Request = typename S::Request;
  using Response = typename S::Response;

  explicit Client(time_ns_t timeout_ns = kDefaultCallTimeout)
      : ClientBase(std::string(CallTraits<S>::name), timeout_ns) {
    offer(call);
  }

  bool next_request(std::vector<std::byte>& message, std::uint32_t& number) override {
    const auto request = std::make_unique<Request>();
    if (!take_request(number, [&] { *request = request_; })) return false;
    CdrWriter(message).put(*request);
    return true;
  }
  void answer(std::uint32_t number, std::span<const std::byte> message) override {
    const auto response = std::make_unique<Response>();
    if (!CdrReader(message).get(*response)) return refuse(number, CallOutcome::malformed);
    end(number, CallOutcome::answered, [&] { response_ = *response; });
  }

 private:
  class Call final : public RequestService<S> {
   public:
    explicit Call(Client& owner) : RequestService<S>("call"), owner_(owner) {}
    /// [rt] Sleeps until answered, for the client's timeout at most.
    CallOutcome call(const Request& request, Response& response) noexcept override {
      return owner_.ClientBase::call([&] { owner_.request_ = request; },
                                     [&] { response = owner_.response_; });
    }

   private:
    Client& owner_;
  };

  Request request_{};
  Response response_{};

 public:
  Call call{*this};
};

/// As architectures name and make it. All functions [setup].
struct ClientKind {
  static ResourceKind describe() {
    return {.name = "client",
            .parameters = {{.name = "timeout_ns",
                            .initial = kDefaultCallTimeout,
                            .description = "how long a call may take",
                            .unit = "ns",
                            .minimum = 1,
                            .file_key = "service.timeout_ms"}},
            .type = TypeNeed::call};
  }
  template <DescribedCall S>
  static std::unique_ptr<Resource> make(const ResourceParameters& given) {
    return std::make_unique<Client<S>>(get<std::int64_t>(given, "timeout_ns"));
  }
};

}  // namespace mauve

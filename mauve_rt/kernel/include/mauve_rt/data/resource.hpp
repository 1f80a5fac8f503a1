// SPDX-License-Identifier: LGPL-3.0-or-later
// Resources: data plus the services to reach it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mauve_rt/base/configurable.hpp"
#include "mauve_rt/base/log.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/trace.hpp"
#include "mauve_rt/data/frames.hpp"
#include "mauve_rt/data/number_place.hpp"
#include "mauve_rt/data/service.hpp"

namespace mauve {

class ActionClientBase;
class ActionServerBase;
class ClientBase;

/// Tells one waiting thread that some published resource was written.
///
/// | member   | written by                         | order                                                                    |
/// | -------- | ---------------------------------- | ------------------------------------------------------------------------ |
/// | word_    | writers                            | seq_cst with waiting_: the writer sees the waiter or the waiter the word |
/// | waiting_ | the waiter, its waker takes it     | seq_cst: likewise; stays set when no thread woke it, which costs one wake.|
/// |          |                                    | With the word: a late writer takes no waiter that has seen its write     |
class Notifier {
 public:
  /// Wakes the waiter if one sleeps. [rt]
  void notify() MAUVE_RT;
  /// Sleeps until notified after `seen` was returned, or until the instant; returns the word to pass next.
  /// [non-rt]
  std::uint32_t wait(std::uint32_t seen, time_ns_t until_ns) noexcept;
  /// [rt]
  std::uint32_t word() const MAUVE_RT { return word_.load(std::memory_order_seq_cst); }

 private:
  static constexpr std::uint64_t kNone = 0;
  static constexpr std::uint64_t kWaits = std::uint64_t{1} << 32U;  // below it the word

  Atomic<std::uint32_t> word_{0};
  Atomic<std::uint64_t> waiting_{kNone};
};

/// Someone told of every write to a resource, e.g. a task that waits for one.
class EventListener {
 public:
  EventListener() = default;
  virtual ~EventListener() = default;
  EventListener(const EventListener&) = delete;
  EventListener& operator=(const EventListener&) = delete;

  /// Called on the writer's thread with the writer's time, the data in place, under the listeners' lock.
  /// [rt] Short; writes to and listens to no resource.
  virtual void on_event(time_ns_t time_ns) MAUVE_RT = 0;
  /// A message for the resource has arrived, by a way that may be earlier than its write; under the same lock.
  /// [rt] Short, as on_event().
  virtual void on_arrival(time_ns_t /*time_ns*/) MAUVE_RT {}
  /// Who writes what arrives has written all that had arrived by then; under the same lock. [rt] Short, as on_event().
  virtual void on_caught_up(time_ns_t /*until_ns*/) MAUVE_RT {}
  /// A component has accepted or ended a goal of the resource; under the same lock. [rt] Short, as on_event().
  virtual void on_decision(time_ns_t /*time_ns*/) MAUVE_RT {}
};

/// The listeners of one resource, in the order they came; a write without any costs one load.
///
/// | member        | written by       | read by          | under                                                    |
/// | ------------- | ---------------- | ---------------- | -------------------------------------------------------- |
/// | listeners_    | ordinary threads | ordinary threads | change_mutex_, which writers never take                  |
/// | the same      | the same         | writers          | mutex_; held without any allocation                      |
/// | count_        | ordinary threads | writers          | relaxed: only says whether to look, under mutex_, at all |
class EventListeners {
 public:
  /// A write calls all of them, so this bounds what it costs.
  static constexpr std::size_t kCapacity = 1024;

  /// Adds one registration; who is added twice is called twice. [non-rt]
  /// Throws Error (out_of_range) naming the resource when there are kCapacity.
  void add(EventListener& listener, const std::string& resource);
  /// Takes one registration away, if there is one; no call to it is under way afterwards. [non-rt]
  void remove(EventListener& listener) noexcept;
  /// Gives the registration of one to another: no write goes by in between. [non-rt]
  void replace(EventListener& listener, EventListener& by) noexcept;
  /// Calls all. [rt]
  void call(time_ns_t time_ns) MAUVE_RT {
    if (count_.load(std::memory_order_relaxed) != 0) call_all(&EventListener::on_event, time_ns);
  }
  /// As call(), of the others of EventListener. [rt]
  void call_arrival(time_ns_t time_ns) MAUVE_RT { call_all(&EventListener::on_arrival, time_ns); }
  void call_caught_up(time_ns_t until_ns) MAUVE_RT { call_all(&EventListener::on_caught_up, until_ns); }
  void call_decision(time_ns_t time_ns) MAUVE_RT {
    if (count_.load(std::memory_order_relaxed) != 0) call_all(&EventListener::on_decision, time_ns);
  }
  /// While who calls this holds it, no listener is called: for what must not be split by a write. [rt] Short.
  PiMutex& mutex() MAUVE_RT { return mutex_; }

 private:
  static constexpr std::size_t kFirst = 8;

  using Call = void (EventListener::*)(time_ns_t) MAUVE_RT;
  void call_all(Call what, time_ns_t time_ns) MAUVE_RT;

  Mutex change_mutex_;
  PiMutex mutex_;
  std::vector<EventListener*> listeners_;
  Atomic<std::size_t> count_{0};
};

/// How a resource is bound to a topic.
enum class TopicBinding : std::uint8_t { none, publish, subscribe };

/// Derive from this to offer services of your own; a service is a member registered by offer().
///
/// | member   | written by       | read by           | under / order                                                  |
/// | -------- | ---------------- | ----------------- | -------------------------------------------------------------- |
/// | use_     | ordinary threads | the same          | use_mutex_                                                     |
/// | stop_ns_ | begin_stop()     | who sends samples | relaxed: before the write, so who has the sample sees the time |
/// | log_     | [setup]          | anyone            | its own: log.hpp                                               |
/// | frame_guard_ | its own      | writers           | its own: frames.hpp                                            |
/// | stops_   | end_stop()       | who sends samples | release/acquire: who sees the count finds the sample           |
class Resource : public ConfigurablePart, public std::enable_shared_from_this<Resource> {
 public:
  /// `kind` and `type` as the architecture file names them.
  Resource(std::string kind, std::string type) : kind_(std::move(kind)), type_(std::move(type)) {}

  /// [rt]
  const std::string& kind() const MAUVE_RT { return kind_; }
  const std::string& type() const MAUVE_RT { return type_; }
  const std::vector<ServiceBase*>& services() const MAUVE_RT { return services_; }
  /// The service of that name, or nullptr. [non-rt]
  ServiceBase* find_service(std::string_view name) const noexcept;
  /// [rt]
  const std::string& name() const MAUVE_RT { return name_; }
  /// Given by the architecture, once. [setup]
  virtual void set_name(const std::string& name) { name_ = name; }
  std::string description() const override { return "resource " + name_; }
  /// Given by the architecture, once, with the name. [setup]
  void set_log_queue(std::shared_ptr<LogQueue> queue) {
    log_.set_up(std::move(queue), LogLine::kNoComponent, TraceNames::intern(name_));
  }
  /// [rt]
  LogSource& log_source() MAUVE_RT { return log_; }
  const LogSource& log_source() const MAUVE_RT { return log_; }
  /// The longest execution for which one user holds its lock; 0: not declared. [rt]
  time_ns_t longest_hold_ns() const MAUVE_RT { return longest_hold_ns_; }
  /// For the timing analysis: nothing enforces it. Before ports are connected. [setup]
  /// Throws Error (out_of_range): below 0, or above kLongest.
  void set_longest_hold_ns(time_ns_t longest_hold_ns);

  /// The frames of its values, before ports are connected; a component's ports may declare them, too. [setup]
  /// Throws Error (invalid_argument): a bad name.
  void set_frames(const Frames& frames);
  /// What it checks of the messages that are written. [rt]
  FrameGuard& frame_guard() MAUVE_RT { return frame_guard_; }
  const FrameGuard& frame_guard() const MAUVE_RT { return frame_guard_; }

  /// Notified of writes and calls, for those who carry them outside; `of_stops`: of the writes of a stop, too. [setup]
  virtual void set_notifier(Notifier* notifier, Notifier* of_stops = nullptr) noexcept {
    notifier_ = notifier;
    stop_notifier_ = of_stops;
  }
  /// Whom else to tell of every write that succeeded, until unlisten(), while writers run. [non-rt]
  /// Throws Error (out_of_range) when there are too many.
  void listen(EventListener& listener) { listeners_.add(listener, name_); }
  /// After this the listener is called no more and may end. [non-rt]
  void unlisten(EventListener& listener) noexcept { listeners_.remove(listener); }
  /// From now on the other is called in place of a listener. [non-rt]
  void relisten(EventListener& listener, EventListener& by) noexcept { listeners_.replace(listener, by); }
  /// While it is held no listener is called. [rt] Short; nothing is written and nobody listens under it.
  PiMutex& events_mutex() MAUVE_RT { return listeners_.mutex(); }
  /// What a connection holds: it keeps a resource that is owned by a shared pointer alive, and in use; empty for any other.
  /// [non-rt]
  std::shared_ptr<const void> use();
  /// Whether somebody holds a use: a port that is connected, or will be, or was and is not told yet. [non-rt]
  bool is_in_use() const;
  /// Counts who calls write_sample(), e.g. an incoming topic, as one port of each service that writes.
  /// [setup] Throws Error (invalid_argument) when one takes no more.
  void bind_input();

  // A stop writes between these two what `on_stop` of an output says.

  /// [rt]
  void begin_stop(time_ns_t time_ns) MAUVE_RT {
    time_ns_t before_ns = stop_ns_.load(std::memory_order_relaxed);
    while (before_ns < time_ns &&
           !stop_ns_.compare_exchange_weak(before_ns, time_ns, std::memory_order_relaxed)) {
    }
  }
  /// [rt]
  void end_stop() MAUVE_RT {
    stops_.fetch_add(1, std::memory_order_release);
    if (stop_notifier_ != nullptr) stop_notifier_->notify();
  }
  /// A sample of this time, or of an earlier one, was written by a stop or before it. [rt]
  time_ns_t stop_ns() const MAUVE_RT { return stop_ns_.load(std::memory_order_relaxed); }
  /// How many stops have written. [rt]
  std::uint32_t stops() const MAUVE_RT { return stops_.load(std::memory_order_acquire); }

  // The serialized face, for topics and for languages other than C++. Ordinary threads.

  /// Whether the three below do anything. [rt]
  virtual bool is_serializable() const MAUVE_RT { return false; }
  /// The next sample not seen yet (`seen` is kept by the caller); a ring's element is removed. [non-rt]
  virtual bool next_sample(std::vector<std::byte>& /*message*/, time_ns_t& /*time*/,
                           std::uint64_t& /*seen*/) {
    return false;
  }
  /// The next sample not handed out by this call yet, of a published one. [non-rt], one thread
  bool next_published(std::vector<std::byte>& message, time_ns_t& time_ns) {
    return notifier_ != nullptr && next_sample(message, time_ns, handed_out_);
  }
  /// Looks at the newest sample without removing it; false, and the type's default, when nothing was written yet.
  /// `sequence`: how many were written. An empty message: this resource has no value to show. [non-rt]
  virtual bool peek_sample(std::vector<std::byte>& /*message*/, time_ns_t& /*time*/,
                           std::uint64_t& /*sequence*/) {
    return false;
  }
  /// Keeps every write from now on for next_write(), in about so many bytes, until end_log(). [non-rt]
  /// Throws Error (invalid_argument): it has no values to keep.
  virtual void begin_log(std::size_t bytes);
  virtual void end_log() {}
  /// The oldest write that was not taken yet, as a message; false: there is none. [non-rt], one thread
  virtual bool next_write(std::vector<std::byte>& /*message*/, time_ns_t& /*time*/) { return false; }
  /// Writes that found no room there. [rt]
  virtual std::uint64_t lost_writes() const MAUVE_RT { return 0; }
  /// What its values take, all those that it has room for; 0: not known. [non-rt]
  virtual std::size_t memory_bytes() const { return 0; }
  /// Values that a write or a read refused: a sequence had more elements than the capacity, or a message was in another frame. [rt]
  virtual std::uint64_t refused_values() const MAUVE_RT { return frame_guard_.refused(); }
  /// Why the last of them was, in words; empty: none was. [non-rt]
  virtual std::string why_refused_value() const { return frame_guard_.refusal(); }
  /// Writes a serialized message with the time at which it was written; false when malformed or there is no room.
  /// [non-rt]
  virtual bool write_sample(std::span<const std::byte> /*message*/, time_ns_t /*time*/) { return false; }
  /// For who calls write_sample(): a message has arrived by another way, and may be written later, or never. [rt]
  void arrived(time_ns_t time_ns) MAUVE_RT { listeners_.call_arrival(time_ns); }
  /// All that had arrived by then was written; kForever: no receiver reports that any more. [rt]
  void caught_up(time_ns_t until_ns) MAUVE_RT { listeners_.call_caught_up(until_ns); }
  /// Why write_sample() has just refused this message, in words. [non-rt]
  virtual std::string why_refused(std::span<const std::byte> message) const;

  /// Where the number at a path such as twist.linear.x lies in its newest value; nothing: it has none at a fixed place.
  /// [non-rt]
  virtual std::optional<NumberPlace> find_number(std::string_view /*path*/) const { return {}; }
  /// That number in the newest value; false when there is none yet. [rt]
  virtual bool read_number(const NumberPlace& /*place*/, double& /*number*/) MAUVE_RT { return false; }

  /// Its values that are always valid, for a topic of their own; nullptr: there are none. It lives as long. [non-rt]
  virtual Resource* static_side() noexcept { return nullptr; }

  /// What it is seen from those who carry its calls; nullptr: no client. [rt]
  virtual ClientBase* client() MAUVE_RT { return nullptr; }
  /// What it is seen from those who carry its goals; nullptr: no such kind. [rt]
  virtual ActionServerBase* action_server() MAUVE_RT { return nullptr; }
  virtual ActionClientBase* action_client() MAUVE_RT { return nullptr; }

 protected:
  /// Lines of this resource, also those of its services on the threads of components. [rt]
  Log log() const MAUVE_RT { return Log(&log_); }
  void offer(ServiceBase& service) {
    service.resource_ = this;
    services_.push_back(&service);
  }
  /// Tells who carries samples and calls out of the architecture. [rt]
  void notify() MAUVE_RT {
    if (notifier_ != nullptr) notifier_->notify();
  }
  /// To be called by services after a write that succeeded, no lock held. [rt]
  void written(time_ns_t time_ns) MAUVE_RT {
    notify();
    listeners_.call(time_ns);
  }
  /// As written(), of a component's decision about a goal: the wait of the component for an event goes on. [rt]
  void decided(time_ns_t time_ns) MAUVE_RT {
    notify();
    listeners_.call_decision(time_ns);
  }

 private:
  std::string kind_;
  std::string type_;
  std::string name_;
  LogSource log_;
  time_ns_t longest_hold_ns_{0};
  FrameGuard frame_guard_;
  std::vector<ServiceBase*> services_;
  Notifier* notifier_{nullptr};
  Notifier* stop_notifier_{nullptr};
  Atomic<time_ns_t> stop_ns_{INT64_MIN};
  Atomic<std::uint32_t> stops_{0};
  std::uint64_t handed_out_{0};  // as `seen`, of next_published()
  EventListeners listeners_;
  mutable Mutex use_mutex_;
  std::weak_ptr<const void> use_ MAUVE_GUARDED_BY(use_mutex_);
};

/// A resource that holds one newest value: its serialized face is one look at it.
class NewestResource : public Resource {
 public:
  using Resource::Resource;
  bool is_serializable() const noexcept override { return true; }
  bool next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override {
    return serialize(message, time_ns, seen) == DataStatus::new_data;
  }
  bool peek_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& sequence) override {
    sequence = 0;
    return serialize(message, time_ns, sequence) != DataStatus::none;
  }

 private:
  /// The value as a message; `seen` as ReaderState::seen. [non-rt]
  virtual DataStatus serialize(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) = 0;
};

}  // namespace mauve

// SPDX-License-Identifier: LGPL-3.0-or-later
// Topics of other nodes, received for a recorder: serialized, without the interpreter, and counted.
#pragma once

#include <rcl/event.h>
#include <rcl/subscription.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

#include "message_batch.hpp"
#include "owned.hpp"
#include "receiver.hpp"

namespace mauve::bridge {

/// The messages lost before they came here, by the sequence numbers of their writers. What a writer sent before the first
/// message that came of it, or after the last one, is not known. For one thread at a time.
class SequenceGaps {
 public:
  /// Of a message of a writer; returns how many were lost so far, of all writers. [non-rt]
  std::uint64_t follow(const rmw_gid_t& writer, std::uint64_t sequence);

 private:
  struct Writer {
    std::array<std::uint8_t, RMW_GID_STORAGE_SIZE> gid;
    std::uint64_t last;  // sequence number
    std::uint64_t used;  // number of the call that saw it last
  };

  std::vector<Writer> writers_;  // few, and one of them sends mostly: a search is cheap
  std::uint64_t calls_{0};
  std::uint64_t lost_{0};
};

/// Messages that wait for the recorder, up to a limit in bytes. All functions [non-rt], from any thread.
///
/// | member    | written by                          | under  |
/// | --------- | ----------------------------------- | ------ |
/// | waiting_  | the receiving thread, take()        | mutex_ |
class ReceivedQueue {
 public:
  explicit ReceivedQueue(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  /// Room for the counts of a further topic; returns its number.
  std::size_t add_topic();
  void add(std::size_t topic, time_ns_t time_ns, std::span<const std::byte> message);
  void set_lost_before(std::size_t topic, std::uint64_t count);
  /// What came since the last call, with all counts.
  MessageBatch take();

 private:
  const std::size_t limit_bytes_;
  Mutex mutex_;
  MessageBatch waiting_ MAUVE_GUARDED_BY(mutex_){0};
};

/// A subscription whose messages go into a queue. Taken from by the receiver's thread.
///
/// | member       | written by           | order                                                                |
/// | ------------ | -------------------- | -------------------------------------------------------------------- |
/// | is_ignored_  | ignore()             | relaxed: which message is the first one ignored is of no importance  |
/// | the rest     | the receiving thread | -                                                                    |
class ReceivedTopic final : public Arrival {
 public:
  /// Throws Error when the type is not installed or rcl refuses. [non-rt]
  ReceivedTopic(rcl_node_t& node, const std::string& name, const std::string& type,
                const rmw_qos_profile_t& qos, ReceivedQueue& queue);
  ~ReceivedTopic() override;

  void join(rcl_wait_set_t& set) override;
  bool has_arrived(const rcl_wait_set_t& set) const override { return set.subscriptions[place_] != nullptr; }
  void take() override;

  /// Messages are taken, and neither kept nor counted. [non-rt]
  void ignore(bool on) { is_ignored_.store(on, std::memory_order_relaxed); }
  /// Asks the middleware what it lost, where messages have no numbers. [non-rt]
  void count_lost();
  /// The policy, as rmw_qos_policy_kind_t, in which a publisher did not fit since the last call; 0: none. [non-rt]
  int take_misfit();

 private:
  void follow(const rmw_message_info_t& about);
  time_ns_t arrival_ns(const rmw_message_info_t& about, time_ns_t now_ns) const;

  ReceivedQueue& queue_;
  Owned<rcl_subscription_t, rcl_subscription_fini> subscription_;
  rcl_event_t lost_{rcl_get_zero_initialized_event()};
  rcl_event_t misfit_{rcl_get_zero_initialized_event()};
  bool has_lost_{false};  // the middleware has the event
  bool has_misfit_{false};
  OwnedMessage message_;
  SequenceGaps gaps_;
  time_ns_t caught_up_ns_;  // nothing waited then
  std::size_t number_;
  std::size_t place_{0};  // in the wait set
  Atomic<bool> is_ignored_{false};
};

/// Receives topics on an ordinary thread, so below all components, for a recorder that takes them in batches.
///
/// | member      | written by                    | under                             |
/// | ----------- | ----------------------------- | --------------------------------- |
/// | topics_ ... | subscribe(), stop(), close()  | mutex_; the thread reads topics_ while none of these runs |
class TopicReceiver {
 public:
  /// The node outlives close(). What waits for take() has so many bytes at most. [non-rt]
  TopicReceiver(rcl_node_t& node, std::size_t limit_bytes);
  ~TopicReceiver();
  TopicReceiver(const TopicReceiver&) = delete;
  TopicReceiver& operator=(const TopicReceiver&) = delete;

  /// Whether the middleware numbers the messages of each writer, so that gaps are known. [non-rt]
  static bool numbered();

  /// Returns the number of the topic, counted from 0. After start() the receiving thread is started again: messages that
  /// arrive during the restart wait in the middleware. Throws Error as ReceivedTopic. [non-rt]
  std::size_t subscribe(const std::string& name, const std::string& type, const rmw_qos_profile_t& qos);
  /// Throws Error when rcl refuses. [non-rt]
  void start();
  /// Takes what has arrived a last time. May be called again. [non-rt]
  void stop();
  /// stop(), and the subscriptions end. What came stays for take(). [non-rt]
  void close();
  /// What came since the last call. [non-rt]
  MessageBatch take();
  /// As ReceivedTopic; nothing after close(). [non-rt]
  void ignore(std::size_t number, bool on);
  std::vector<int> take_misfits();

 private:
  rcl_node_t& node_;
  ReceivedQueue queue_;
  Mutex mutex_;
  std::vector<Arrival*> arrivals() const MAUVE_REQUIRES(mutex_);

  std::vector<std::unique_ptr<ReceivedTopic>> topics_ MAUVE_GUARDED_BY(mutex_);
  std::unique_ptr<Receiver> receiver_ MAUVE_GUARDED_BY(mutex_);
};

}  // namespace mauve::bridge

// SPDX-License-Identifier: LGPL-3.0-or-later
// Resources: data plus the services to reach it.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "mauve_rt/configurable.hpp"
#include "mauve_rt/service.hpp"

namespace mauve {

/// Tells one waiting thread that some published resource was written.
///
/// | member   | written by            | order                                                                    |
/// | -------- | --------------------- | ------------------------------------------------------------------------ |
/// | word_    | writers               | seq_cst with waiters_: the writer sees the waiter or the waiter the word |
/// | waiters_ | the thread that waits | seq_cst: likewise                                                        |
class Notifier {
 public:
  /// Wakes the waiter if one sleeps. [rt]
  void notify() noexcept;
  /// Sleeps until notified after `seen` was returned, or until the instant; returns the word to pass next.
  /// [non-rt]
  std::uint32_t wait(std::uint32_t seen, time_ns_t until_ns) noexcept;
  /// [rt]
  std::uint32_t word() const noexcept { return word_.load(std::memory_order_seq_cst); }

 private:
  std::atomic<std::uint32_t> word_{0};
  std::atomic<std::uint32_t> waiters_{0};
};

/// Derive from this to offer services of your own; a service is a member registered by offer().
class Resource : public Configurable {
 public:
  /// `kind` and `type` as the architecture file names them.
  Resource(std::string kind, std::string type) : kind_(std::move(kind)), type_(std::move(type)) {}

  const std::string& kind() const noexcept { return kind_; }
  const std::string& type() const noexcept { return type_; }
  const std::vector<ServiceBase*>& services() const noexcept { return services_; }
  /// The service of that name, or nullptr.
  ServiceBase* find_service(std::string_view name) const noexcept;
  const std::string& name() const noexcept { return name_; }
  /// Given by the architecture, once. [setup]
  virtual void set_name(const std::string& name) { name_ = name; }
  std::string description() const override { return "resource " + name_; }

  /// Whom to tell of writes, for topics. [setup]
  void set_notifier(Notifier* notifier) noexcept { notifier_ = notifier; }

  // The serialized face, for topics and for languages other than C++. Ordinary threads.

  /// Whether the three below do anything.
  virtual bool is_serializable() const noexcept { return false; }
  /// The next sample not seen yet (`seen` is kept by the caller); a ring's element is removed. [non-rt]
  virtual bool next_sample(std::vector<std::byte>& /*message*/, time_ns_t& /*time*/,
                           std::uint64_t& /*seen*/) {
    return false;
  }
  /// Looks at the newest sample without removing it; false when there is none. [non-rt]
  virtual bool peek_sample(std::vector<std::byte>& /*message*/, time_ns_t& /*time*/,
                           std::uint64_t& /*sequence*/) {
    return false;
  }
  /// Writes a serialized message, stamped with the real clock; false when malformed or there is no room.
  /// [non-rt]
  virtual bool write_sample(std::span<const std::byte> /*message*/) { return false; }

 protected:
  void offer(ServiceBase& service) { services_.push_back(&service); }
  /// To be called by services after a write. [rt]
  void notify() const noexcept {
    if (notifier_ != nullptr) notifier_->notify();
  }

 private:
  std::string kind_;
  std::string type_;
  std::string name_;
  std::vector<ServiceBase*> services_;
  Notifier* notifier_{nullptr};
};

}  // namespace mauve

// SPDX-License-Identifier: LGPL-3.0-or-later
// A resource whose every write can be recorded.
#pragma once

#include "mauve_rt/base/biased_mutex.hpp"
#include "mauve_rt/data/cdr.hpp"
#include "mauve_rt/data/resource.hpp"
#include "mauve_rt/data/write_log.hpp"

namespace mauve {

/// Puts a write log into a resource of values of type T, beside what it has from `Base`. `Lock`: what its writers hold.
template <Described T, typename Base, typename Lock = BiasedMutex>
class LoggedResource : public Base {
 public:
  using Base::Base;
  void begin_log(std::size_t bytes) override { log_.open(bytes, writers()); }
  void end_log() override { log_.close(writers()); }
  bool next_write(std::vector<std::byte>& message, time_ns_t& time_ns) override {
    return log_.next([&](const WrittenValue<T>& written) {
      time_ns = written.time_ns;
      CdrWriter(message).put(written.value);
    });
  }
  std::uint64_t lost_writes() const noexcept override { return log_.lost(); }

 protected:
  /// After a write that succeeded. [rt] Under the lock of the writers.
  void log(const T& value, time_ns_t time_ns) MAUVE_RT { log_.put(value, time_ns); }

 private:
  /// The lock that every writer holds. [rt]
  virtual Lock& writers() MAUVE_RT = 0;

  WriteLog<WrittenValue<T>> log_;  // under writers()
};

}  // namespace mauve

// SPDX-License-Identifier: LGPL-3.0-or-later
// CommandWatch: for drivers; the last command as long as it is fresh, else the safe one. Needs the standard library only.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace mauve::driver {

/// Keeps the last command, and yields the safe one once nothing has come for a time.
///
///     mauve::driver::CommandWatch<double> watch(std::chrono::milliseconds(300), 0.0);
///     // where a message arrives:   watch.received(message.data);
///     // in the driver's own loop:  set_speed(watch.value());
///
/// The age counts from the reception, by `Clock` of this computer: neither the sender's time nor a step of the wall clock counts.
/// One thread receives, any number read; no thread waits for another. No exception, lock or memory after the construction.
///
/// | member | written by   | read by | order                                                                             |
/// | ------ | ------------ | ------- | --------------------------------------------------------------------------------- |
/// | count_ | the receiver | anyone  | release/acquire: who sees a number sees its place whole                           |
/// | places_ | the receiver | anyone | release/acquire: who reads a word of a later command sees a later count_, too     |
template <typename Command, typename Clock = std::chrono::steady_clock>
class CommandWatch {
  static_assert(std::is_trivially_copyable_v<Command>, "a command is copied word by word");

 public:
  using Duration = typename Clock::duration;

  /// `safe`: before the first command, and from `timeout` after the last one on. Throws std::invalid_argument: the timeout is not
  /// positive. [setup]
  CommandWatch(Duration timeout, const Command& safe) : timeout_(timeout), safe_(safe) {
    if (timeout <= Duration::zero()) throw std::invalid_argument("CommandWatch: expected a timeout above 0");
  }

  /// A command has come now. [rt] as far as the clock is. One thread.
  void received(const Command& command) noexcept {
    const std::uint64_t next = count_.load(std::memory_order_relaxed) + 1;  // relaxed: written here only
    Place& place = places_[next % kPlaces];
    Words words{};
    std::memcpy(words.data(), &command, sizeof(Command));
    for (std::size_t i = 0; i < kWords; ++i) place.words[i].store(words[i], std::memory_order_release);
    place.received.store(Clock::now().time_since_epoch().count(), std::memory_order_release);
    count_.store(next, std::memory_order_release);
  }

  /// What to do now. [rt] as far as the clock is.
  Command value() const noexcept {
    const Last last = newest();
    return last.is_there && last.age < timeout_ ? last.command : safe_;
  }
  /// Whether that is the safe command for want of a fresh one. [rt] as far as the clock is.
  bool is_safe() const noexcept {
    const Last last = newest();
    return !last.is_there || last.age >= timeout_;
  }
  /// Time since the last command; the largest there is before the first one. [rt] as far as the clock is.
  Duration age() const noexcept {
    const Last last = newest();
    return last.is_there ? last.age : Duration::max();
  }

 private:
  static constexpr std::size_t kWords = (sizeof(Command) + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t);
  static constexpr std::size_t kPlaces = 4;  // a reader reads again only after three more commands have come
  using Words = std::array<std::uint64_t, kWords>;
  struct Place {
    std::array<std::atomic<std::uint64_t>, kWords> words{};
    std::atomic<typename Duration::rep> received{0};  // time since the clock's epoch
  };
  struct Last {
    bool is_there;
    Command command;
    Duration age;
  };

  Last newest() const noexcept {
    for (;;) {
      const std::uint64_t count = count_.load(std::memory_order_acquire);
      if (count == 0) return {.is_there = false, .command = safe_, .age = {}};
      const Place& place = places_[count % kPlaces];
      Words words{};
      for (std::size_t i = 0; i < kWords; ++i) words[i] = place.words[i].load(std::memory_order_acquire);
      const Duration received(place.received.load(std::memory_order_acquire));
      // relaxed: where a word was of a later command, its acquire shows the count before that one
      if (count_.load(std::memory_order_relaxed) >= count + kPlaces - 1) continue;
      Last last{.is_there = true, .command = safe_, .age = Clock::now().time_since_epoch() - received};
      std::memcpy(&last.command, words.data(), sizeof(Command));
      return last;
    }
  }

  const Duration timeout_;
  const Command safe_;
  std::array<Place, kPlaces> places_{};
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace mauve::driver

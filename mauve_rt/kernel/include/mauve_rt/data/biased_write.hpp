// SPDX-License-Identifier: LGPL-3.0-or-later
// BiasedWrite: the service `write` of a resource, for its only port without a lock.
#pragma once

#include <memory>
#include <string>

#include "mauve_rt/base/biased_mutex.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/trace.hpp"
#include "mauve_rt/data/frames.hpp"
#include "mauve_rt/data/service.hpp"

namespace mauve {

/// Keeps writers apart. The resource has `bool take(value, time_ns)`, which it calls under mutex(), and written(); for large
/// values also borrow(), publish() and give_back() of a place, each called under mutex(), and make_room_to_write().
///
/// | member | written by             | under   |
/// | ------ | ---------------------- | ------- |
/// | floor_ | commits, who deploys   | its own |
template <Described T, typename Owner>
class BiasedWrite final : public WriteService<T> {
 public:
  /// `max_ports`: 0: any number. [setup]
  explicit BiasedWrite(Owner& owner, std::uint32_t max_ports = 0)
      : WriteService<T>("write"), owner_(owner), max_ports_(max_ports) {}

  std::uint32_t max_ports() const noexcept override { return max_ports_; }
  bool write(const T& value, time_ns_t time_ns) noexcept override { return put(value, time_ns, nullptr); }
  bool write_seated(const T& value, time_ns_t time_ns, BiasedMutex::Seat& seat) noexcept override {
    return put(value, time_ns, &seat);
  }
  TryWrite try_write(const T& value, time_ns_t time_ns) noexcept override {
    if constexpr (kIsCopied) {
      if (const Frames* const frames = expected_frames(); frames != nullptr) [[unlikely]] {
        T framed = value;
        return fill_frames(framed, *frames) ? try_write_now(framed, time_ns) : TryWrite::done;
      }
    }
    return try_write_now(value, time_ns);
  }
  T* borrow(BiasedMutex::Seat* seat) noexcept override {
    if constexpr (kIsLarge<T>) {
      const BiasedMutex::Hold hold(mutex_, seat);
      return owner_.borrow();
    }
    return nullptr;
  }
  bool publish(T& place, time_ns_t time_ns, BiasedMutex::Seat* seat) noexcept override {
    if (owner_.limits().admits(place) && set_frames(place)) return publish_admitted(place, time_ns, seat);
    give_back(place, seat);
    return false;
  }
  void give_back(T& place, BiasedMutex::Seat* seat) noexcept override {
    if constexpr (kIsLarge<T>) {
      const BiasedMutex::Hold hold(mutex_, seat);
      owner_.give_back(place);
    }
  }
  std::unique_ptr<T> make() const override { return owner_.limits().make(); }
  void make_room(std::uint32_t ports) override {
    if constexpr (kIsLarge<T>) owner_.make_room_to_write(ports);
  }
  void raise_floor(time_ns_t instant_ns) noexcept override { floor_.raise(instant_ns); }
  void forget_floor() noexcept override { floor_.forget(); }
  bool seat(BiasedMutex::Seat& seat) noexcept override {
    mutex_.add(seat);
    return true;
  }
  void unseat(BiasedMutex::Seat& seat) noexcept override { mutex_.remove(seat); }
  bool is_wait_free() const noexcept override { return mutex_.is_biased(); }
  void share() noexcept override { mutex_.share(); }

  /// What every writer holds. [rt]
  BiasedMutex& mutex() MAUVE_RT { return mutex_; }

 private:
  /// Whether a value without frames is written as a copy that has them; a large one has them written into its place.
  static constexpr bool kIsCopied = HasFrame<T> && !kIsLarge<T>;

  const Frames* expected_frames() const noexcept { return owner_.frame_guard().expected(); }
  /// Whether a message is in the resource's frames, which it gets where it names none.
  bool set_frames(T& value) noexcept {
    if constexpr (HasFrame<T>) {
      if (const Frames* const frames = expected_frames(); frames != nullptr) [[unlikely]]
        return owner_.frame_guard().admits(frame_ids(value)) && fill_frames(value, *frames);
    }
    return true;
  }
  TryWrite try_write_now(const T& value, time_ns_t time_ns) noexcept {
    {
      if (!mutex_.try_lock()) return TryWrite::busy;
      const LockGuard lock(mutex_, std::adopt_lock);
      if (!floor_.admits(time_ns) || !owner_.take(value, time_ns)) return TryWrite::done;
    }
    owner_.written(time_ns);
    return TryWrite::done;
  }
  bool publish_admitted(T& place, time_ns_t time_ns, BiasedMutex::Seat* seat) noexcept {
    if constexpr (kIsLarge<T>) {
      {
        const BiasedMutex::Hold hold(mutex_, seat);
        if (!floor_.admits(time_ns)) {
          owner_.give_back(place);
          return true;
        }
        if (!owner_.publish(place, time_ns)) return false;
      }
      owner_.written(time_ns);
    }
    return true;
  }
  bool put(const T& value, time_ns_t time_ns, BiasedMutex::Seat* seat) noexcept {
    if constexpr (kIsLarge<T>) {
      T* const place = owner_.limits().admits(value) ? borrow(seat) : nullptr;
      if (place == nullptr) return false;
      *place = value;  // not under the lock
      if (set_frames(*place)) return publish_admitted(*place, time_ns, seat);
      give_back(*place, seat);
      return false;
    } else if constexpr (kIsCopied) {
      if (expected_frames() != nullptr) [[unlikely]] {
        T framed = value;
        return set_frames(framed) && put_now(framed, time_ns, seat);
      }
    }
    return put_now(value, time_ns, seat);
  }
  bool put_now(const T& value, time_ns_t time_ns, BiasedMutex::Seat* seat) noexcept {
    {
      const BiasedMutex::Hold hold(mutex_, seat);
      if (!floor_.admits(time_ns)) return true;
      if (!owner_.take(value, time_ns)) return false;
    }
    owner_.written(time_ns);
    return true;
  }

  Owner& owner_;
  std::uint32_t max_ports_;
  BiasedMutex mutex_;
  WriteFloor floor_;
};

}  // namespace mauve

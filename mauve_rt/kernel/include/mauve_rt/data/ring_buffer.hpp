// SPDX-License-Identifier: LGPL-3.0-or-later
// RingBuffer: a queue of bounded length; a read removes, so each element goes to one reader.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/biased_mutex.hpp"
#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/trace.hpp"
#include "mauve_rt/data/biased_write.hpp"
#include "mauve_rt/data/logged_resource.hpp"
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

/// What a full ring does with one more element.
enum class WhenFull : std::uint8_t { refuse, overwrite };

/// A bounded queue; services `read` (removes the oldest) and `write`. A reader that finds it empty gets status
/// old if it ever got an element, and no value.
///
/// Each end has a lock of its own, biased to its only port: between one writer port and one reader port it is a wait-free queue
/// of a single producer and a single consumer (L. Lamport, 1977), each of which looks at the other one's index only when its
/// copy of it does not suffice (P. Lee, T. Bu, G. Chandranmenon: "A lock-free, cache-efficient shared ring buffer", 2009). One that overwrites has one lock
/// for both ends, without a bias: its writer removes elements too. tests/models/loom explores the queue and its biased mutex.
///
/// Large elements lie in blocks, and a place has the address of one: a writer fills a spare block and exchanges it for that of the
/// place, a reader takes the place's block for a spare one. So a port copies nothing under a lock. The newest element stays in its
/// block, wherever that goes, until a writer fills it again: who looks at it keeps it from the writers meanwhile.
///
/// | member            | written by | read by    | under / order                                                    |
/// | ----------------- | ---------- | ---------- | ---------------------------------------------------------------- |
/// | places_           | writers    | readers    | a place between head_ and tail_ is its reader's, else its writer's |
/// | spare blocks      | each end   | each end   | the mutex of that end; blocks_: who prepares a connection, room_mutex_ |
/// | newest, looked_at | writers, who looks | the same | write.mutex(); one looks at a time: looker_mutex_         |
/// | Writers::tail     | writers    | readers    | write.mutex(); release / acquire: publishes the place           |
/// | Readers::head     | readers    | writers    | readers_mutex_; release / acquire: the place may be filled again |
/// | the rest of both  | the same   | the same   | that mutex                                                       |
/// | Writers::lost     | writers    | any        | relaxed: a figure that nothing depends on                        |
template <Described T>
class RingBuffer final : public LoggedResource<T, Resource> {
 public:
  /// Throws Error (invalid_argument) without a capacity. [setup]
  explicit RingBuffer(std::size_t capacity, WhenFull when_full = WhenFull::refuse, Capacities capacities = {})
      : LoggedResource<T, Resource>("ring_buffer", type_name<T>(), std::move(capacities)),
        places_(capacity),
        when_full_(when_full) {
    if (capacity == 0) {
      throw Error(ErrorCode::invalid_argument, "a ring_buffer needs a capacity",
                  {.element = "capacity", .expected = "> 0", .found = "0", .remedy = "add capacity: N"});
    }
    if (overwrites()) write.mutex().share();
    if constexpr (kIsLarge<T>) {
      for (Place& place : places_) place.value = new_block();
      add_spares(writers_.spares, write.mutex(), kOtherWriters);
      add_spares(readers_.spares, readers_mutex(), kOtherReaders);
    }
    this->offer(read);
    this->offer(write);
  }

  void set_name(const std::string& name) override {
    Resource::set_name(name);
    write.mutex().set_trace_id(TraceNames::intern(name));
    readers_mutex_.set_trace_id(TraceNames::intern(name));
  }
  bool is_serializable() const noexcept override { return true; }
  /// [rt]
  std::size_t capacity() const MAUVE_RT { return places_.size(); }
  /// Elements refused or overwritten since the start. [rt]
  std::uint64_t lost() const MAUVE_RT { return writers_.lost.load(std::memory_order_relaxed); }

  bool next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) override {
    ReaderState reader{.seen = seen};
    if constexpr (kIsLarge<T>) {  // without a copy
      const Loan<T> loan = lend(reader);
      if (loan.value == nullptr) return false;
      seen = reader.seen;
      time_ns = loan.time_ns;
      CdrWriter(message).put(*loan.value);
      end_loan(loan, reader);
      return true;
    }
    const auto value = read.make();
    if (pop(*value, time_ns, reader) != DataStatus::new_data) return false;
    seen = reader.seen;
    CdrWriter(message).put(*value);
    return true;
  }
  /// The element written last; a reader may have removed it.
  bool peek_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& sequence) override {
    if constexpr (kIsLarge<T>) {  // without a copy
      const LockGuard one_at_a_time(looker_mutex_);
      const T* const newest = begin_look(time_ns, sequence);
      CdrWriter(message).put(newest != nullptr ? *newest : *read.make());
      end_look();
      return newest != nullptr;
    }
    const auto value = read.make();
    {
      const LockGuard lock(write.mutex());
      const Place& newest = places_[(writers_.place == 0 ? places_.size() : writers_.place) - 1];
      *value = newest.get();
      time_ns = newest.time_ns;
      sequence = writers_.tail.load(std::memory_order_relaxed);  // relaxed: written under this lock
    }
    CdrWriter(message).put(*value);
    return sequence != 0;
  }
  bool write_sample(std::span<const std::byte> message, time_ns_t time_ns) override {
    return write.write_message(message, time_ns);
  }

 protected:
  std::string why_refused_whole(const T& value, std::span<const std::byte> /*message*/) const override {
    const std::string of_frame = this->frame_guard().why_refused(frame_ids(value));
    return of_frame.empty() ? "the ring_buffer was full: " + std::to_string(capacity()) + " elements"
                            : of_frame;
  }

 private:
  static constexpr std::size_t kCacheLine = 64;

  static constexpr std::size_t kOtherReaders = 2;  // a topic, and who takes messages by hand
  static constexpr std::size_t kOtherWriters = 3;  // the same, and the block that somebody looks at
  using Block = std::conditional_t<kIsLarge<T>, T*, T>;
  using Spares = std::vector<T*>;

  struct Place {
    Block value{};
    time_ns_t time_ns{0};

    const T& get() const noexcept {
      if constexpr (kIsLarge<T>) {
        return *value;
      } else {
        return value;
      }
    }
  };
  /// Elements are counted from 1 on, by their sequence.
  struct alignas(kCacheLine) Writers {
    Atomic<std::uint64_t> tail{0};  // elements written so far
    std::uint64_t head{0};          // as seen last
    std::size_t place{0};           // of the next element
    Atomic<std::uint64_t> lost{0};
    Spares spares;
    T* newest{nullptr};  // of large elements: the block with the last one
    time_ns_t newest_ns{0};
    const T* looked_at{nullptr};  // the block that is not filled again now
    bool is_kept{false};          // whether it came back meanwhile
  };
  struct alignas(kCacheLine) Readers {
    Atomic<std::uint64_t> head{0};  // elements removed so far
    std::uint64_t tail{0};          // as seen last
    std::size_t place{0};           // of the oldest element
    Spares spares;
  };
  class Read final : public ReadService<T> {
   public:
    explicit Read(RingBuffer& owner) : ReadService<T>("read"), owner_(owner) {}
    DataStatus read(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept override {
      return owner_.pop(value, time_ns, reader);
    }
    bool seat(BiasedMutex::Seat& seat) noexcept override {
      if (owner_.overwrites()) return false;
      owner_.readers_mutex_.add(seat);
      return true;
    }
    void unseat(BiasedMutex::Seat& seat) noexcept override { owner_.readers_mutex_.remove(seat); }
    bool is_wait_free() const noexcept override { return owner_.readers_mutex_.is_biased(); }
    bool keeps_values() const noexcept override { return false; }
    bool lends(const ReaderState& /*reader*/) const noexcept override { return kIsLarge<T>; }
    Loan<T> lend(ReaderState& reader) noexcept override {
      if constexpr (kIsLarge<T>) {
        return owner_.lend(reader);
      } else {
        return {};
      }
    }
    void end_loan(const Loan<T>& loan, ReaderState& reader) noexcept override {
      if constexpr (kIsLarge<T>) owner_.end_loan(loan, reader);
    }
    std::unique_ptr<T> make() const override { return owner_.limits().make(); }
    bool is_whole(const T& value) noexcept override { return owner_.limits().admits(value); }
    void make_room(std::uint32_t ports) override {
      if constexpr (kIsLarge<T>)
        owner_.make_spares(owner_.readers_.spares, owner_.readers_mutex(), ports + kOtherReaders);
    }

   private:
    RingBuffer& owner_;
  };
  friend class BiasedWrite<T, RingBuffer>;

  BiasedMutex& writers() noexcept override { return write.mutex(); }
  std::size_t values() const override {
    if constexpr (kIsLarge<T>) {
      const LockGuard lock(room_mutex_);
      return blocks_.size();
    }
    return places_.size();
  }
  bool overwrites() const noexcept { return when_full_ == WhenFull::overwrite; }

  BiasedMutex& readers_mutex() noexcept { return overwrites() ? write.mutex() : readers_mutex_; }

  DataStatus pop(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept {
    if constexpr (kIsLarge<T>) {
      const Loan<T> loan = lend(reader);
      if (loan.status == DataStatus::new_data) value = *loan.value;  // not under the lock
      if (loan.status != DataStatus::none) time_ns = loan.time_ns;
      end_loan(loan, reader);
      return loan.status;
    }
    Loan<T> oldest;
    const BiasedMutex::Hold hold(readers_mutex(), reader.seat);
    if (!find_oldest(oldest, reader)) {
      if (oldest.status != DataStatus::none) time_ns = oldest.time_ns;
      return oldest.status;
    }
    value = *oldest.value;
    time_ns = oldest.time_ns;
    remove(readers_.head.load(std::memory_order_relaxed));  // relaxed: written under this lock
    return DataStatus::new_data;
  }
  /// Under the readers' lock; whether there is one, which stays.
  bool find_oldest(Loan<T>& found, ReaderState& reader) noexcept {
    const std::uint64_t head =
        readers_.head.load(std::memory_order_relaxed);  // relaxed: written under this lock
    if (readers_.tail <= head) {  // less: the writer has overwritten elements since the last look
      readers_.tail = writers_.tail.load(std::memory_order_acquire);
      if (readers_.tail == head) {
        if (reader.seen != 0) found = {nullptr, DataStatus::old_data, reader.time_ns};
        return false;
      }
    }
    MAUVE_AUDIT(readers_.tail > head && readers_.tail - head <= places_.size());
    const Place& place = places_[readers_.place];
    found = {&place.get(), DataStatus::new_data, place.time_ns};
    reader.seen = head + 1;
    return true;
  }
  Loan<T> lend(ReaderState& reader) noexcept {
    Loan<T> loan;
    const BiasedMutex::Hold hold(readers_mutex(), reader.seat);
    if (readers_.spares.empty() || !find_oldest(loan, reader)) return loan;
    std::swap(places_[readers_.place].value, readers_.spares.back());
    readers_.spares.pop_back();
    remove(readers_.head.load(std::memory_order_relaxed));  // relaxed: written under this lock
    return loan;
  }
  void end_loan(const Loan<T>& loan, ReaderState& reader) MAUVE_RT {
    if (loan.value == nullptr) return;
    const BiasedMutex::Hold hold(readers_mutex(), reader.seat);
    MAUVE_RT_TRUSTED(
        readers_.spares.push_back(const_cast<T*>(loan.value)));  // within its capacity: add_spares()
  }
  /// The oldest; under the readers' lock.
  void remove(std::uint64_t head) noexcept {
    MAUVE_AUDIT(head < writers_.tail.load(std::memory_order_acquire));
    if (++readers_.place == places_.size()) readers_.place = 0;
    readers_.head.store(head + 1, std::memory_order_release);
  }
  // The next four: under the writers' lock.

  T* borrow() noexcept {
    if (writers_.spares.empty()) return nullptr;
    T* const place = writers_.spares.back();
    writers_.spares.pop_back();
    return place;
  }
  void give_back(T& place) MAUVE_RT {
    if (&place == writers_.looked_at) {
      writers_.is_kept = true;  // until end_look()
      return;
    }
    MAUVE_RT_TRUSTED(writers_.spares.push_back(&place));  // within its capacity: add_spares()
  }
  bool publish(T& value, time_ns_t time_ns) noexcept {
    T* block = &value;
    const bool is_taken = has_room();
    if (is_taken) {
      this->log(value, time_ns);
      std::swap(places_[writers_.place].value, block);
      writers_.newest = &value;
      writers_.newest_ns = time_ns;
      add(time_ns);
    }
    give_back(*block);
    return is_taken;
  }
  bool take(const T& value, time_ns_t time_ns) noexcept {
    if constexpr (kIsLarge<T>) {
      T* const place = borrow();
      if (place == nullptr) return false;
      *place = value;
      return publish(*place, time_ns);
    } else {
      if (!has_room()) return false;
      places_[writers_.place].value = value;
      this->log(value, time_ns);
      add(time_ns);
      return true;
    }
  }
  bool has_room() noexcept {
    const std::uint64_t tail =
        writers_.tail.load(std::memory_order_relaxed);  // relaxed: written under this lock
    if (tail - writers_.head == places_.size()) {
      writers_.head = readers_.head.load(std::memory_order_acquire);
      if (tail - writers_.head == places_.size()) {
        writers_.lost.fetch_add(1, std::memory_order_relaxed);
        if (!overwrites()) return false;
        remove(writers_.head++);  // its readers have the same lock
      }
    }
    MAUVE_AUDIT(tail - writers_.head < places_.size());
    return true;
  }
  void add(time_ns_t time_ns) noexcept {
    places_[writers_.place].time_ns = time_ns;
    if (++writers_.place == places_.size()) writers_.place = 0;
    const std::uint64_t tail =
        writers_.tail.load(std::memory_order_relaxed);  // relaxed: written under this lock
    writers_.tail.store(tail + 1, std::memory_order_release);
  }

  /// The newest element, which no writer touches until end_look(); nullptr: there was none. [non-rt]
  const T* begin_look(time_ns_t& time_ns, std::uint64_t& sequence) {
    const LockGuard no_writer(write.mutex());
    time_ns = writers_.newest_ns;
    sequence = writers_.tail.load(std::memory_order_relaxed);  // relaxed: written under this lock
    return writers_.looked_at = writers_.newest;
  }
  void end_look() {
    const LockGuard no_writer(write.mutex());
    const T* const block = std::exchange(writers_.looked_at, nullptr);
    if (std::exchange(writers_.is_kept, false)) give_back(*const_cast<T*>(block));
  }

  T* new_block() {
    blocks_.push_back(this->limits().make());
    return blocks_.back().get();
  }
  /// For an end with so many users. [non-rt]
  void make_spares(Spares& spares, BiasedMutex& mutex, std::size_t users) {
    const LockGuard lock(room_mutex_);
    std::size_t spare = 0;
    {
      const LockGuard no_user(mutex);
      spare = spares.size();
    }
    // What is lent now may be of one that was left behind in a state that hangs.
    if (spare < users) add_spares(spares, mutex, users - spare);
  }
  void add_spares(Spares& spares, BiasedMutex& mutex, std::size_t count) {
    Spares more;
    more.reserve(blocks_.size() + count);  // all that there are: any of them may come back here
    while (count-- > 0) more.push_back(new_block());
    const LockGuard no_user(mutex);
    more.insert(more.end(), spares.begin(), spares.end());
    spares.swap(more);
  }
  void make_room_to_write(std::uint32_t ports) {
    make_spares(writers_.spares, write.mutex(), ports + kOtherWriters);
  }

  Writers writers_;
  Readers readers_;
  std::vector<Place> places_;
  WhenFull when_full_;
  mutable Mutex room_mutex_;
  Mutex looker_mutex_;
  std::vector<std::unique_ptr<T>> blocks_;  // of large elements: of the places, and spare ones of each end
  alignas(kCacheLine) BiasedMutex readers_mutex_;

 public:
  Read read{*this};
  alignas(kCacheLine) BiasedWrite<T, RingBuffer> write{*this};
};

/// As architectures name and make it. All functions [setup].
struct RingBufferKind {
  static ResourceKind describe() {
    return {
        .name = "ring_buffer",
        .parameters = {{.name = "capacity",
                        .initial = std::int64_t{1},
                        .description = "how many elements the ring_buffer holds",
                        .minimum = 1,
                        .maximum = 1'000'000,
                        .is_required = true,
                        .values_each = 1},
                       {.name = "overwrite",
                        .initial = false,
                        .description = "whether a full one drops its oldest element rather than the new one"},
                       max_bytes_parameter()},
        .type = TypeNeed::data};
  }
  template <Described T>
  static std::unique_ptr<Resource> make(const ResourceParameters& given) {
    return std::make_unique<RingBuffer<T>>(
        static_cast<std::size_t>(get<std::int64_t>(given, "capacity")),
        get<bool>(given, "overwrite") ? WhenFull::overwrite : WhenFull::refuse,
        capacities_of(message_shape<T>(), given));
  }
};

}  // namespace mauve

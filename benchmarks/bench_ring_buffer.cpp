// SPDX-License-Identifier: LGPL-3.0-or-later
// RingBuffer between two CPUs: with one reader, with two readers, and the single-producer single-consumer queue of Boost.
//   bench_ring_buffer [--blocks 41] [--calls 1024] [--priority 80] [--cpu 0] --other-cpu 1
// Prints for 16 and 4096 bytes {"stream_16_ps": [...], "stream_two_16_ps": [...], "boost_stream_16_ps": [...],
// "echo_16_ps": [...], ...} in picoseconds an element or a round trip, then "elements" and "wrong": of the RingBuffer,
// elements that were lost, repeated or torn. Without Boost, the names with "boost" are absent.
//
// stream: the other CPU pushes without pause, the measured thread pops. A push to a full queue and a pop from an empty one
// are retried at once. echo: an element goes through one queue and comes back through a second one.
#include "mauve_rt/mauve_rt.hpp"

#if __has_include(<boost/lockfree/spsc_queue.hpp>)
#include <boost/lockfree/spsc_queue.hpp>
#define MAUVE_BENCH_HAS_BOOST 1
#else
#define MAUVE_BENCH_HAS_BOOST 0
#endif

#include "support/micro.hpp"
#include "support/partner.hpp"
#include "support/values.hpp"

namespace {

enum class Readers { one, two };

/// A RingBuffer with its ports; each end is of another component.
template <typename T, std::size_t kCapacity, Readers kReaders>
class Ring {
 public:
  Ring() {
    ring_.set_name("ring");
    output_.set_context(&writing_);
    for (mauve::ReadPort<T>* port : {&input_, &second_}) port->set_context(&reading_);
    output_.connect(ring_.write, "ring");
    input_.connect(ring_.read, "ring");
    if (kReaders == Readers::two) second_.connect(ring_.read, "ring");
  }
  bool push(const T& value) { return output_.write(value); }
  bool pop(T& value) { return input_.read(value) == mauve::DataStatus::new_data; }

 private:
  mauve::Context writing_;  // without one a port would read the clock to stamp
  mauve::Context reading_;
  mauve::RingBuffer<T> ring_{kCapacity};
  mauve::WritePort<T> output_{"output"};
  mauve::ReadPort<T> input_{"input"};
  mauve::ReadPort<T> second_{"second"};
};

#if MAUVE_BENCH_HAS_BOOST
template <typename T, std::size_t kCapacity>
class BoostRing {
 public:
  bool push(const T& value) { return queue_.push(value); }
  bool pop(T& value) { return queue_.pop(value); }

 private:
  boost::lockfree::spsc_queue<T> queue_{
      kCapacity};  // as with the RingBuffer, the capacity is known at run time
};
#endif

void set_number(bench::Small& value, std::int64_t number) { value = {number, number}; }
void set_number(bench::Large& value, std::int64_t number) {
  value.items.front() = value.items.back() = static_cast<double>(number);
}
bool has_number(const bench::Small& value, std::int64_t number) {
  return value.first == number && value.second == number;
}
bool has_number(const bench::Large& value, std::int64_t number) {
  return value.items.front() == static_cast<double>(number) && value.items.back() == value.items.front();
}

/// Elements of the measured thread.
struct Findings {
  std::int64_t elements{0};
  std::int64_t wrong{0};
};

/// A queue of numbered elements in either direction, and both threads' parts in what is measured.
template <typename T, typename Queue>
class Duel {
 public:
  explicit Duel(bench::Partner& partner) : partner_(partner) {}

  bench::Side stream(const std::string& name) {
    return {name, [this](std::int64_t calls) { pop(calls); }, [this] { end_stream(); },
            [this] {
              partner_.begin(push_);
              pop(kWarmUp);  // else elements that were pushed earlier would shorten the block
            }};
  }
  bench::Side echo(const std::string& name) {
    return {name, [this](std::int64_t calls) { exchange(calls); }, [this] { end(); },
            [this] { partner_.begin(answer_); }};
  }
  const Findings& found() const { return found_; }

 private:
  static constexpr std::int64_t kTries = 64;     // between two looks at what the measured thread requests
  static constexpr std::int64_t kWarmUp = 1024;  // the capacity, at least

  void pop(std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) {
      while (!there_->pop(received_)) {
      }
      check(++number_);
    }
  }
  void exchange(std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) {
      set_number(sent_, ++number_);
      bench::keep(sent_);
      there_->push(sent_);  // empty: takes it
      while (!back_->pop(received_)) {
      }
      check(number_);
    }
  }
  void check(std::int64_t number) {
    bench::keep(received_);
    ++found_.elements;
    if (!has_number(received_, number)) ++found_.wrong;
  }
  void end_stream() {
    partner_.rest();
    while (there_->pop(received_)) check(++number_);
    pushed_ = number_;
    end();
  }
  /// Real-time threads that never sleep would leave both CPUs to no other thread.
  void end() {
    partner_.rest();
    bench::sleep_until(mauve::monotonic_now_ns() + mauve::ms_to_ns(1));
  }

  bench::Partner& partner_;
  const std::unique_ptr<Queue> there_{std::make_unique<Queue>()};
  const std::unique_ptr<Queue> back_{std::make_unique<Queue>()};
  std::int64_t number_{0};
  T sent_{};
  T received_{};
  Findings found_;
  // The partner's while it runs.
  alignas(64) std::int64_t pushed_{0};
  T its_{};
  const bench::Partner::Turn push_{[this] {
    for (std::int64_t i = 0; i < kTries; ++i) {
      set_number(its_, pushed_ + 1);
      bench::keep(its_);
      if (there_->push(its_)) ++pushed_;
    }
  }};
  const bench::Partner::Turn answer_{[this] {
    for (std::int64_t i = 0; i < kTries; ++i) {
      if (there_->pop(its_)) back_->push(its_);
    }
  }};
};

template <typename T, std::size_t kCapacity>
void measure_type(const bench::Micro& micro, bench::Partner& partner, bench::JsonLine& line, Findings& found,
                  const std::string& size) {
  Duel<T, Ring<T, kCapacity, Readers::one>> one(partner);
  Duel<T, Ring<T, kCapacity, Readers::two>> two(partner);
#if MAUVE_BENCH_HAS_BOOST
  Duel<T, BoostRing<T, kCapacity>> boost(partner);
#endif
  bench::Micro longer = micro;
  longer.calls *= 2;  // more than the queue holds
  longer.compare(line, {one.stream("stream_" + size),
#if MAUVE_BENCH_HAS_BOOST
                        boost.stream("boost_stream_" + size),
#endif
                        two.stream("stream_two_" + size)});
  micro.compare(line, {one.echo("echo_" + size),
#if MAUVE_BENCH_HAS_BOOST
                       boost.echo("boost_echo_" + size),
#endif
                       two.echo("echo_two_" + size)});
  for (const Findings& each : {one.found(), two.found()}) {
    found.elements += each.elements;
    found.wrong += each.wrong;
  }
#if MAUVE_BENCH_HAS_BOOST
  if (boost.found().wrong != 0) throw std::runtime_error("the queue of Boost loses or tears elements");
#endif
}

void measure(const bench::Options& options) {
  const bench::Micro micro(options);
  bench::Partner partner(micro.priority, static_cast<int>(options.number("other-cpu", 1)));
  bench::JsonLine line;
  Findings found;
  measure_type<bench::Small, 1024>(micro, partner, line, found, "16");
  measure_type<bench::Large, 64>(micro, partner, line, found, "4096");
  line.add("elements", found.elements).add("wrong", found.wrong);
  line.print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }

// SPDX-License-Identifier: LGPL-3.0-or-later
// Reading and writing SharedData through ports, next to locking a bare priority-inheritance mutex, copying, unlocking:
// alone, and while a thread on another CPU uses the same value without pause.
//   bench_shared_data [--blocks 41] [--calls 1024] [--priority 80] [--cpu 0] [--other-cpu -1]
// Prints for read and write of 16 and 4096 bytes {"read_16_ps": [...], "bare_read_16_ps": [...],
// "hammered_read_16_ps": [...], "bare_hammered_read_16_ps": [...], ...} in picoseconds a call, then "copy_ps" and
// "bare_copy_ps": 1 MiB written and read, next to two memcpy; "in_place_ps": the same in place, next to one. Without another CPU, the names with "hammered" are absent.
#include <pthread.h>

#include <cstring>

#include "mauve_rt/mauve_rt.hpp"

#include "support/micro.hpp"
#include "support/partner.hpp"
#include "support/values.hpp"

namespace {

/// What one would write without this project.
template <typename T>
class BareCell {
 public:
  BareCell() {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
  }
  ~BareCell() { pthread_mutex_destroy(&mutex_); }
  BareCell(const BareCell&) = delete;
  BareCell& operator=(const BareCell&) = delete;

  void write(const T& value) {
    pthread_mutex_lock(&mutex_);
    value_ = value;
    pthread_mutex_unlock(&mutex_);
  }
  void read(T& value) {
    pthread_mutex_lock(&mutex_);
    value = value_;
    pthread_mutex_unlock(&mutex_);
  }

 private:
  pthread_mutex_t mutex_{};
  T value_{};
};

/// A SharedData with its ports; each end is of another component.
template <typename T>
class Cell {
 public:
  Cell() {
    data_.set_name("data");
    output_.set_context(&writing_);
    input_.set_context(&reading_);
    output_.connect(data_.write, "data");
    input_.connect(data_.read, "data");
    output_.write(T{});
  }
  void write(const T& value) { output_.write(value); }
  void read(T& value) { input_.read(value); }
  mauve::WritePort<T>& output() { return output_; }
  mauve::ReadPort<T>& input() { return input_; }

 private:
  mauve::Context writing_;  // without one a port would read the clock to stamp
  mauve::Context reading_;
  mauve::SharedData<T> data_;
  mauve::WritePort<T> output_{"output"};
  mauve::ReadPort<T> input_{"input"};
};

template <typename T, typename In>
auto writes_to(In& cell, T& value) {
  return [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i) {
      bench::keep(value);
      cell.write(value);
    }
  };
}
template <typename T, typename In>
auto reads_of(In& cell, T& value) {
  return [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i) {
      cell.read(value);
      bench::keep(value);
    }
  };
}

template <typename T>
void measure_type(const bench::Micro& micro, bench::Partner* partner, bench::JsonLine& line,
                  const std::string& size) {
  Cell<T> cell;
  BareCell<T> bare;
  T value{};
  const auto write = writes_to(cell, value);
  const auto read = reads_of(cell, value);
  const auto bare_write = writes_to(bare, value);
  const auto bare_read = reads_of(bare, value);
  micro.compare(line, {{"write_" + size, write}, {"bare_write_" + size, bare_write}});
  micro.compare(line, {{"read_" + size, read}, {"bare_read_" + size, bare_read}});
  if (partner == nullptr) return;

  struct {
    alignas(64) T value{};
  } its;
  constexpr std::int64_t kCallsATurn = 64;
  const auto turns = [](auto calls) { return bench::Partner::Turn([calls] { calls(kCallsATurn); }); };
  const bench::Partner::Turn hammer_write = turns(writes_to(cell, its.value));
  const bench::Partner::Turn hammer_read = turns(reads_of(cell, its.value));
  const bench::Partner::Turn hammer_bare_write = turns(writes_to(bare, its.value));
  const bench::Partner::Turn hammer_bare_read = turns(reads_of(bare, its.value));
  const auto rest = [&] {
    partner->rest();
    // Real-time threads that never sleep would leave both CPUs to no other thread.
    bench::sleep_until(mauve::monotonic_now_ns() + mauve::ms_to_ns(1));
  };
  micro.compare(
      line, {{"hammered_read_" + size, read, rest, [&] { partner->begin(hammer_write); }},
             {"bare_hammered_read_" + size, bare_read, rest, [&] { partner->begin(hammer_bare_write); }}});
  micro.compare(
      line, {{"hammered_write_" + size, write, rest, [&] { partner->begin(hammer_read); }},
             {"bare_hammered_write_" + size, bare_write, rest, [&] { partner->begin(hammer_bare_read); }}});
}

/// Writes and reads a large value on one thread. The buffers in turn, of more bytes than the caches near the CPU hold.
void measure_copies(const bench::Micro& micro, bench::JsonLine& line) {
  using bench::Huge;
  constexpr std::size_t kBuffers = 8;
  std::vector<Huge> from(kBuffers);
  std::vector<Huge> to(kBuffers);
  const auto cell = std::make_unique<Cell<Huge>>();
  const auto middle = std::make_unique<Huge>();
  std::size_t next = 0;
  const auto ours = [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i, next = (next + 1) % kBuffers) {
      cell->write(from[next]);
      cell->read(to[next]);
      bench::keep(to[next]);
    }
  };
  const auto bare = [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i, next = (next + 1) % kBuffers) {
      std::memcpy(middle.get(), &from[next], sizeof(Huge));
      bench::keep(*middle);
      std::memcpy(&to[next], middle.get(), sizeof(Huge));
      bench::keep(to[next]);
    }
  };
  const auto in_place = [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i, next = (next + 1) % kBuffers) {
      cell->output().write_with([&](Huge& place) { std::memcpy(&place, &from[next], sizeof(Huge)); });
      cell->input().with([](const Huge& value) { bench::keep(value); });
    }
  };
  const auto bare_in_place = [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i, next = (next + 1) % kBuffers) {
      std::memcpy(&to[next], &from[next], sizeof(Huge));
      bench::keep(to[next]);
    }
  };
  bench::Micro fewer = micro;
  fewer.calls = std::max<std::int64_t>(1, micro.calls / 64);
  fewer.compare(line, {{"copy", ours}, {"bare_copy", bare}});
  fewer.compare(line, {{"in_place", in_place}, {"bare_in_place", bare_in_place}});
}

void measure(const bench::Options& options) {
  const bench::Micro micro(options);
  const auto other_cpu = static_cast<int>(options.number("other-cpu", -1));
  std::optional<bench::Partner> partner;
  if (other_cpu >= 0) partner.emplace(micro.priority, other_cpu);
  bench::Partner* const other = partner ? &*partner : nullptr;
  bench::JsonLine line;
  measure_type<bench::Small>(micro, other, line, "16");
  measure_type<bench::Large>(micro, other, line, "4096");
  measure_copies(micro, line);
  line.print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }

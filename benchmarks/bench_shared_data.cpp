// SPDX-License-Identifier: LGPL-3.0-or-later
// Reading and writing SharedData through ports, nobody else about, beside locking a bare priority-inheritance
// mutex, copying, unlocking.
//   bench_shared_data [--blocks 41] [--calls 1024] [--priority 80] [--cpu 0]
// Prints for read and write of 16 and 4096 bytes {"read_16_ps": [...], "bare_read_16_ps": [...], ...} in
// picoseconds a call.
#include <pthread.h>

#include "mauve_rt/mauve_rt.hpp"

#include "support/micro.hpp"
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

template <typename T>
void measure_type(const bench::Micro& micro, bench::JsonLine& line, const std::string& size) {
  mauve::SharedData<T> data;
  data.set_name("data");
  mauve::Context context;  // of a component: without one a port would read the clock to stamp
  mauve::WritePort<T> output("output");
  mauve::ReadPort<T> input("input");
  output.set_context(&context);
  input.set_context(&context);
  output.connect(data.write, "data");
  input.connect(data.read, "data");
  BareCell<T> bare;
  T value{};
  const auto write = [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i) {
      bench::keep(value);
      output.write(value);
    }
  };
  const auto read = [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i) {
      input.read(value);
      bench::keep(value);
    }
  };
  const auto bare_write = [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i) {
      bench::keep(value);
      bare.write(value);
    }
  };
  const auto bare_read = [&](std::int64_t calls) {
    for (std::int64_t i = 0; i < calls; ++i) {
      bare.read(value);
      bench::keep(value);
    }
  };
  micro.compare(line, {{"write_" + size, write}, {"bare_write_" + size, bare_write}});
  micro.compare(line, {{"read_" + size, read}, {"bare_read_" + size, bare_read}});
}

void measure(const bench::Options& options) {
  const bench::Micro micro(options);
  bench::JsonLine line;
  measure_type<bench::Small>(micro, line, "16");
  measure_type<bench::Large>(micro, line, "4096");
  line.print();
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, measure); }

// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/process_end.hpp"

#include <malloc.h>
#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/seam/thread.hpp"
#include "mauve_rt/deploy/deployer.hpp"

namespace mauve {

namespace {

/// For the handler of the dump signal.
constexpr time_ns_t kDump = ms_to_ns(100);

/// As nohup asks. A script has SIGINT and SIGQUIT ignored for what it starts in the background: they end the process all the
/// same.
bool stays_ignored(int signal) noexcept {
  struct sigaction present{};
  sigaction(signal, nullptr, &present);
  return signal == SIGHUP && present.sa_handler == SIG_IGN;
}

sigset_t end_signals() noexcept {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int each : kEndSignals) {
    if (!stays_ignored(each)) sigaddset(&signals, each);
  }
  return signals;
}

/// The threads that end the process after a signal, whatever the others do. They are there before it and wait.
///
/// | member            | written by            | read by      | order                                       |
/// | ----------------- | --------------------- | ------------ | ------------------------------------------- |
/// | begun_, dumps_    | begin(), end()        | both threads | release/acquire: a word to sleep on, set once |
class Ending {
 public:
  explicit Ending(const EndOptions& options) : options_(options) {
    OrdinaryThread([this] { end(); }).detach();
    if (options.dump_signal != 0) OrdinaryThread([this] { dump(); }).detach();
  }
  void begin() noexcept { set(begun_); }

 private:
  static void set(Atomic<std::uint32_t>& word) noexcept {
    word.store(1, std::memory_order_release);
    futex_wake_all(word);
  }
  static void await(const Atomic<std::uint32_t>& word) noexcept {
    while (word.load(std::memory_order_acquire) == 0) futex_wait_until(word, 0, kForever);
  }
  void end() noexcept {
    await(begun_);
    sleep_for(options_.grace_ns);
    if (options_.dump_signal != 0) {
      set(dumps_);
      sleep_for(kDump);
    }
    _exit(options_.status);
  }
  void dump() noexcept {
    await(dumps_);
    dprintf(STDERR_FILENO, "The process did not end within %lld ms of the signal. Its threads:\n",
            static_cast<long long>(options_.grace_ns / ms_to_ns(1)));
    raise(options_.dump_signal);
  }

  const EndOptions options_;
  Atomic<std::uint32_t> begun_{0};
  Atomic<std::uint32_t> dumps_{0};
};

/// Memory for the end of the process, kept until the signal. The allocator gives the blocks to any thread that gets no more from
/// the system; the room in the address space is for mappings. For the main thread: its arena serves the others, too.
class Reserve {
 public:
  Reserve() noexcept
      : room_(mmap(nullptr, kRoom, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0)) {
    for (void*& block : blocks_) {
      block = std::malloc(kBlock);
      if (block != nullptr) std::memset(block, 1, kBlock);  // in memory from here on
    }
  }
  void release() noexcept {
    mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());  // the blocks stay with the process
    for (void* const block : blocks_) std::free(block);
    if (room_ != MAP_FAILED) munmap(room_, kRoom);
  }

 private:
  static constexpr std::size_t kBlock = 64UL << 10U;  // below the size that the allocator maps apart
  static constexpr std::size_t kRoom = 32UL << 20U;

  std::array<void*, 64> blocks_{};
  void* room_;
};

}  // namespace

void block_end_signals() noexcept {
  const sigset_t signals = end_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

int wait_end_signal(const EndOptions& options) {
  Reserve reserve;
  auto* const ending = new Ending(options);  // its threads outlive this call
  const int signal = await_signal(end_signals());
  ending->begin();  // first: a component that does not end must not keep the process
  reserve.release();
  Deployer::end_all();
  return signal;
}

}  // namespace mauve

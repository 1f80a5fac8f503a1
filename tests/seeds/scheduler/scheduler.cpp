// SPDX-License-Identifier: LGPL-3.0-or-later
#include "seeds/scheduler.hpp"

#include <execinfo.h>
#include <linux/futex.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/time.hpp"

#include "seeds/happens_before.hpp"

namespace mauve::seeds {

// Threads count it down, one at a time. Before begin(), and in the process of the test program, it has no end.
constinit std::atomic<std::uint64_t> atomics_left{UINT64_MAX};

struct Thread {
  int number{0};
  std::array<char, 16> name{};
  int priority{0};
  std::atomic<std::uint32_t> baton{0};  // 1: it is here
  pthread_t handle{};
  std::uint32_t id{0};  // as futexes with priority inheritance know it
  void* (*entry)(void*){nullptr};
  void* argument{nullptr};

  time_ns_t ready_ns{0};         // it can run from then on; kForever: when it is woken
  const void* address{nullptr};  // what it is woken by
  Call call{Call::begin};        // its last one
  bool is_woken{false};
  bool is_granted{false};           // a futex with priority inheritance
  const Thread* inherits{nullptr};  // who inherits its priority
  time_ns_t cpu_ns{0};
  time_ns_t left_ns{0};  // the processor, last
  time_ns_t kept_ns{0};  // from running, by others
  bool has_ended{false};
};

namespace {

constexpr time_ns_t kFirstInstant = s_to_ns(1000);
constexpr std::size_t kMostThreads = 512;
constexpr time_ns_t kOfAnAtomicStep = 2;

/// SplitMix64.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() noexcept {
    state_ += 0x9e37'79b9'7f4a'7c15U;
    std::uint64_t mixed = state_;
    mixed = (mixed ^ (mixed >> 30U)) * 0xbf58'476d'1ce4'e5b9U;
    mixed = (mixed ^ (mixed >> 27U)) * 0x94d0'49bb'1331'11ebU;
    return mixed ^ (mixed >> 31U);
  }
  /// `bound`: below 2^32. By a product, as a division takes ten times as long.
  std::uint64_t below(std::uint64_t bound) noexcept { return ((next() >> 32U) * bound) >> 32U; }
  time_ns_t up_to(time_ns_t longest_ns) noexcept {
    return static_cast<time_ns_t>(below(static_cast<std::uint64_t>(longest_ns) + 1));
  }
  bool once_in(std::uint64_t times) noexcept { return times != 0 && below(times) == 0; }

 private:
  std::uint64_t state_;
};

/// How rough the computer of this seed is. A figure of 0: never.
struct Weather {
  std::uint64_t cpus{1};            // so many of the most urgent threads may run
  std::uint64_t switch_once_in{8};  // calls
  std::uint64_t atomic_once_in{0};  // steps of atomic operations, of which each has two
  time_ns_t cost_ns{400};           // of a call, at most
  time_ns_t lateness_ns{us_to_ns(50)};
  std::uint64_t stall_once_in{0};  // calls
  time_ns_t stall_ns{ms_to_ns(5)};
  std::uint64_t chance_once_in{200};  // waits that end without a cause

  static Weather of(Random& random) {
    Weather weather;
    weather.cpus = 1 + random.below(4);
    weather.switch_once_in = std::array<std::uint64_t, 4>{2, 5, 20, 100}[random.below(4)];
    weather.atomic_once_in = std::array<std::uint64_t, 4>{0, 600, 60, 6}[random.below(4)];
    weather.cost_ns = std::array<time_ns_t, 3>{60, 400, 3'000}[random.below(3)];
    weather.lateness_ns = std::array{us_to_ns(1), us_to_ns(40), us_to_ns(300)}[random.below(3)];
    weather.stall_once_in = std::array<std::uint64_t, 3>{0, 50'000, 5'000}[random.below(3)];
    weather.stall_ns = std::array{us_to_ns(500), ms_to_ns(4), ms_to_ns(30)}[random.below(3)];
    weather.chance_once_in = std::array<std::uint64_t, 3>{0, 200, 20}[random.below(3)];
    return weather;
  }
};

/// A thread that has ended is joined by the next one, so that its stack is free at the same call in each run. ThreadSanitizer would take
/// that for synchronization.
#if defined(MAUVE_SEES_RACES)
constexpr bool kIsJoined = false;
#else
constexpr bool kIsJoined = true;
#endif

struct Event {
  time_ns_t at_ns;
  std::int32_t thread;
  Call call;
};

struct Scheduler {
  Options options;
  Random random{0};
  Weather weather;
  std::vector<Thread*> threads;  // by number
  std::vector<Thread*> alive;    // those that have not ended, in the order of their numbers
  std::uint64_t inheriting{0};   // of those, wait for a thread that inherits their priority
  Thread* running{nullptr};
  Thread* ending{nullptr};  // gives the baton away at its very end
  time_ns_t now_ns{kFirstInstant};
  time_ns_t calm_until_ns{0};     // before that instant no other thread preempts the running one
  std::uint64_t atomics_paid{0};  // the countdown, when time last passed for it
  Outcome outcome{.hash = 0xcbf2'9ce4'8422'2325U};
  std::vector<Event> trace;
};

/// Never destroyed: threads may use it to the end of the process.
union NeverDestroyed {
  constexpr NeverDestroyed() noexcept : scheduler{} {}
  ~NeverDestroyed() {}
  Scheduler scheduler;
};
constinit NeverDestroyed never_destroyed;

Scheduler& all() noexcept { return never_destroyed.scheduler; }

constinit thread_local Thread* this_thread [[gnu::tls_model("initial-exec")]] = nullptr;

/// Until the next switch at an atomic operation. Where there are none, time passes all the same: a thread may spin.
void begin_countdown() noexcept {
  Scheduler& s = all();
  const std::uint64_t once_in = s.weather.atomic_once_in;
  s.atomics_paid = once_in == 0 ? 5'000 : 1 + s.random.below(2 * once_in - 1);
  atomics_left.store(s.atomics_paid, std::memory_order_relaxed);
}

void note(const Thread& thread, Call call) noexcept {
  Scheduler& s = all();
  const std::uint64_t fact = static_cast<std::uint64_t>(s.now_ns) * 0x9e37'79b9'7f4a'7c15U +
                             (static_cast<std::uint64_t>(thread.number) << 8U) +
                             static_cast<std::uint64_t>(call);
  s.outcome.hash = (s.outcome.hash ^ fact) * 0x0000'0100'0000'01b3U;
  s.outcome.hash ^= s.outcome.hash >> 29U;
  if (s.options.keeps_trace) s.trace.push_back({s.now_ns, thread.number, call});
}

/// With what it inherits.
int urgency(const Thread& thread, int depth = 0) noexcept {
  int highest = thread.priority;
  if (all().inheriting == 0 || depth > 8) return highest;
  for (const Thread* other : all().alive) {
    if (other->inherits == &thread) highest = std::max(highest, urgency(*other, depth + 1));
  }
  return highest;
}

void let_inherit(Thread& thread, const Thread* heir) noexcept {
  Scheduler& s = all();
  if (thread.inherits != nullptr) --s.inheriting;
  if (heir != nullptr) ++s.inheriting;
  thread.inherits = heir;
  s.calm_until_ns = 0;
}

bool can_run(const Thread& thread) noexcept { return thread.ready_ns <= all().now_ns; }

void await_baton(Thread& thread) noexcept {
  // Not a semaphore: ThreadSanitizer would take the baton for synchronization of the threads under test.
  while (thread.baton.exchange(0, std::memory_order_acquire) == 0)
    syscall(SYS_futex, &thread.baton, FUTEX_WAIT_PRIVATE, 0, nullptr);
  Scheduler& s = all();
  if (s.ending == nullptr) return;
  pthread_join(s.ending->handle, nullptr);  // it does nothing more, at no time
  s.ending = nullptr;
}

void pass_baton(Thread& to) noexcept {
  Scheduler& s = all();
  s.running = &to;
  ++s.outcome.switches;
  to.baton.store(1, std::memory_order_release);
  syscall(SYS_futex, &to.baton, FUTEX_WAKE_PRIVATE, 1);
}

std::string describe(const Thread& thread) {
  std::string text = "  thread " + std::to_string(thread.number) + " '" + thread.name.data() +
                     "', priority " + std::to_string(thread.priority) + ": last call " +
                     to_string(thread.call);
  if (thread.has_ended) return text + ", ended";
  if (&thread == all().running) return text + ", runs";
  if (thread.ready_ns == kForever) return text + ", waits to be woken";
  return text + ", can run in " + std::to_string((thread.ready_ns - all().now_ns) / 1000) + " us";
}

/// Passes time until somebody can run; who is next.
Thread& choose() noexcept {
  Scheduler& s = all();
  std::array<Thread*, kMostThreads> able;  // not initialized: that would take most of the time
  std::array<int, kMostThreads> urgencies;
  for (;;) {
    std::size_t count = 0;
    time_ns_t earliest_ns = kForever;
    for (Thread* thread : s.alive) {
      if (can_run(*thread)) {
        urgencies[count] = urgency(*thread);
        able[count++] = thread;
      } else {
        earliest_ns = std::min(earliest_ns, thread->ready_ns);
      }
    }
    if (count == 0) {
      if (earliest_ns == kForever) fail("deadlock: each thread waits to be woken");
      s.now_ns = earliest_ns;
      continue;
    }
    s.calm_until_ns = earliest_ns;
    // So many of the most urgent ones run at once on that many processors; any of these may be the next to come to a call.
    const std::size_t wanted = s.random.below(std::min<std::uint64_t>(s.weather.cpus, count));
    for (std::size_t i = 0; i <= wanted; ++i) {
      int most = -1;
      std::size_t equals = 0;
      std::size_t found = i;
      for (std::size_t k = i; k < count; ++k) {
        if (urgencies[k] < most) continue;
        equals = urgencies[k] > most ? 1 : equals + 1;
        most = urgencies[k];
        if (s.random.below(equals) == 0) found = k;
      }
      std::swap(able[i], able[found]);
      std::swap(urgencies[i], urgencies[found]);
    }
    Thread& chosen = *able[wanted];
    chosen.kept_ns += s.now_ns - std::max(chosen.ready_ns, chosen.left_ns);
    return chosen;
  }
}

void reschedule() noexcept {
  Thread& before = self();
  before.left_ns = all().now_ns;
  Thread& next = choose();
  if (&next == &before) return;
  pass_baton(next);
  await_baton(before);
}

/// Whether at least as many threads as there are processors are more urgent.
bool is_preempted(const Thread& thread) noexcept {
  Scheduler& s = all();
  if (s.now_ns < s.calm_until_ns) return false;
  std::uint64_t more_urgent = 0;
  time_ns_t earliest_ns = kForever;
  const int own = urgency(thread);
  for (const Thread* other : s.alive) {
    if (!can_run(*other)) {
      earliest_ns = std::min(earliest_ns, other->ready_ns);
    } else if (other != &thread && urgency(*other) > own) {
      ++more_urgent;
    }
  }
  if (more_urgent >= s.weather.cpus) return true;
  s.calm_until_ns = earliest_ns;
  return false;
}

time_ns_t lateness_ns() noexcept {
  Scheduler& s = all();
  switch (s.random.below(16)) {
    case 0:
      return s.random.up_to(10 * s.weather.lateness_ns);
    case 1:
    case 2:
    case 3:
    case 4:
      return s.random.up_to(s.weather.lateness_ns);
    default:
      return s.random.up_to(s.weather.lateness_ns / 10);
  }
}

void wake(Thread& thread) noexcept {
  thread.is_woken = true;
  thread.address = nullptr;
  thread.ready_ns = std::min(thread.ready_ns, all().now_ns + lateness_ns());
  all().calm_until_ns = 0;
}

void check_limits() noexcept {
  const Scheduler& s = all();
  if (s.outcome.calls > s.options.most_calls) fail("livelock: too many calls of the seam");
  if (s.now_ns - kFirstInstant > s.options.longest_ns) fail("livelock: too much time has passed");
}

/// A call begins, or an atomic operation that may be a switch: the time that passed is paid.
void enter(Thread& thread, Call call) noexcept {
  Scheduler& s = all();
  const std::uint64_t left = atomics_left.load(std::memory_order_relaxed);
  const time_ns_t cost_ns = static_cast<time_ns_t>(s.atomics_paid - left) * kOfAnAtomicStep;
  s.atomics_paid = left;
  s.now_ns += cost_ns;
  thread.cpu_ns += cost_ns;
  thread.call = call;
  ++s.outcome.calls;
  note(thread, call);
  check_limits();
}

/// It costs up to that time.
void step(Thread& thread, Call call, time_ns_t longest_ns) noexcept {
  Scheduler& s = all();
  enter(thread, call);
  const time_ns_t cost_ns = 20 + s.random.up_to(longest_ns);
  s.now_ns += cost_ns;
  thread.cpu_ns += cost_ns;
  if (s.random.once_in(s.weather.stall_once_in)) {
    note(thread, Call::stall);
    const time_ns_t stall_ns = s.random.up_to(s.weather.stall_ns);
    s.now_ns += stall_ns;
    s.outcome.stalled_ns += stall_ns;
  }
  if (s.random.once_in(s.weather.switch_once_in) || is_preempted(thread)) reschedule();
}

/// The last that a thread does: its thread-local objects are gone by then.
struct AtTheEnd {
  Thread* thread;
  explicit AtTheEnd(Thread& of) : thread(&of) {}
  ~AtTheEnd() {
    step(Call::thread_end);
    released(thread);
    thread->has_ended = true;
    std::erase(all().alive, thread);
    wake_all(thread);
    this_thread = nullptr;
    Thread& next = choose();
    if (kIsJoined) all().ending = thread;
    pass_baton(next);
  }
  AtTheEnd(const AtTheEnd&) = delete;
  AtTheEnd& operator=(const AtTheEnd&) = delete;
};

void* run(void* argument) {
  Thread& thread = *static_cast<Thread*>(argument);
  this_thread = &thread;
  await_baton(thread);
  thread.id = static_cast<std::uint32_t>(gettid());
  thread_local const AtTheEnd end(thread);  // the first one made is the last one destroyed
  return thread.entry(thread.argument);
}

/// For fail(): each thread prints where it stands.
void print_stack(int /*signal*/) {
  std::array<void*, 40> frames{};
  const int depth = backtrace(frames.data(), static_cast<int>(frames.size()));
  backtrace_symbols_fd(frames.data(), depth, STDERR_FILENO);
}

}  // namespace

const char* to_string(Call call) noexcept {
  static constexpr std::array kNames{
      "begin",       "clock",        "sleep",   "yield",        "futex_wait",  "futex_wake",
      "futex_lock",  "futex_unlock", "lock",    "try_lock",     "unlock",      "lock_shared",
      "cond_wait",   "cond_notify",  "barrier", "thread_start", "thread_join", "thread_end",
      "signal_wait", "stall",        "atomic",  "compute"};
  return kNames[static_cast<std::size_t>(call)];
}

void prepare_forks() noexcept {
  std::array<void*, 1> first{};
  backtrace(first.data(), 1);
  try {
    throw std::runtime_error("prepared");
  } catch (const std::runtime_error&) {  // thrown to be caught
  }
}

void begin(const Options& options) {
  Scheduler& s = all();
  Thread& main = self();
  main.id = static_cast<std::uint32_t>(gettid());
  s.options = options;
  s.random = Random(options.seed * 0x2545'f491'4f6c'dd1dU + 1);
  s.weather = Weather::of(s.random);
  s.outcome.calls = 0;
  s.now_ns = kFirstInstant;
  main.ready_ns = 0;
  begin_countdown();
  struct sigaction action{};
  action.sa_handler = &print_stack;
  sigaction(SIGUSR2, &action, nullptr);
}

Outcome outcome() noexcept {
  Outcome outcome = all().outcome;
  outcome.passed_ns = all().now_ns - kFirstInstant;
  outcome.alive = static_cast<int>(all().alive.size());
  return outcome;
}

std::string alive() {
  std::string text;
  for (const Thread* thread : all().alive) text += describe(*thread) + "\n";
  return text;
}

const char* running() noexcept { return self().name.data(); }

void write_trace(const std::string& path) {
  std::FILE* const file = std::fopen(path.c_str(), "w");
  if (file == nullptr) return;
  for (const Event& event : all().trace) {
    const Thread& thread = *all().threads[static_cast<std::size_t>(event.thread)];
    std::fprintf(file, "%14lld %3d %-15s %s\n", static_cast<long long>(event.at_ns - kFirstInstant),
                 event.thread, thread.name.data(), to_string(event.call));
  }
  std::fclose(file);
}

Thread& self() noexcept {
  if (this_thread != nullptr) return *this_thread;
  Scheduler& s = all();
  if (s.running != nullptr) fail("a thread that the seam did not make calls the seam");
  auto* const main = new Thread;
  std::strcpy(main->name.data(), "main");
  main->handle = pthread_self();
  s.threads.reserve(kMostThreads);
  s.alive.reserve(kMostThreads);
  s.threads.push_back(main);
  s.alive.push_back(main);
  s.running = main;
  return *(this_thread = main);
}

void switch_at_atomic() noexcept {
  enter(self(), Call::atomic);
  begin_countdown();
  reschedule();
}

void switch_often() noexcept {
  Scheduler& s = all();
  s.weather.atomic_once_in = std::array<std::uint64_t, 4>{3, 6, 15, 40}[s.random.below(4)];
  begin_countdown();
}

void step(Call call) noexcept { step(self(), call, all().weather.cost_ns); }

void compute(time_ns_t length_ns) noexcept {
  constexpr time_ns_t kSlice = us_to_ns(10);
  Thread& thread = self();
  const time_ns_t until_ns = thread.cpu_ns + length_ns;
  while (thread.cpu_ns < until_ns) step(thread, Call::compute, std::min(kSlice, until_ns - thread.cpu_ns));
}

bool block(Call call, const void* address, time_ns_t until_ns, bool by_chance) noexcept {
  Scheduler& s = all();
  Thread& thread = self();
  thread.call = call;
  thread.address = address;
  thread.is_woken = false;
  thread.ready_ns = until_ns == kForever ? kForever : later_by(std::max(until_ns, s.now_ns), lateness_ns());
  if (by_chance && s.random.once_in(s.weather.chance_once_in)) {
    const time_ns_t chance_ns = s.now_ns + s.random.up_to(ms_to_ns(1));
    if (chance_ns < until_ns && chance_ns < thread.ready_ns) {
      thread.ready_ns = chance_ns;
      thread.is_woken = true;
    }
  }
  reschedule();
  thread.address = nullptr;
  thread.ready_ns = 0;
  note(thread, call);
  return thread.is_woken;
}

void wake_all(const void* address) noexcept {
  for (Thread* thread : all().alive) {
    if (thread->address == address) wake(*thread);
  }
}

void wake_one(const void* address) noexcept {
  Thread* chosen = nullptr;
  std::uint64_t waiting = 0;
  for (Thread* thread : all().alive) {
    if (thread->address == address && all().random.below(++waiting) == 0) chosen = thread;
  }
  if (chosen != nullptr) wake(*chosen);
}

time_ns_t now_ns() noexcept { return all().now_ns; }
time_ns_t cpu_ns() noexcept { return self().cpu_ns; }
time_ns_t cpu_ns(const Thread& thread) noexcept { return thread.cpu_ns; }
time_ns_t kept_ns() noexcept { return self().kept_ns; }

Thread* start(const NewThread& made, int& error) {
  Scheduler& s = all();
  static_cast<void>(self());
  if (s.threads.size() == kMostThreads) fail("too many threads for the seeded scheduler");
  auto* const thread = new Thread;
  thread->number = static_cast<int>(s.threads.size());
  std::strncpy(thread->name.data(), made.name, thread->name.size() - 1);
  thread->priority = made.priority;
  thread->entry = made.entry;
  thread->argument = made.argument;
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  if (!kIsJoined) pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
  if (made.stack_bytes != 0) pthread_attr_setstacksize(&attributes, made.stack_bytes);
  error = pthread_create(&thread->handle, &attributes, &run, thread);
  pthread_attr_destroy(&attributes);
  if (error != 0) return nullptr;
  thread->ready_ns = s.now_ns + lateness_ns();
  s.threads.push_back(thread);
  s.alive.push_back(thread);
  s.calm_until_ns = 0;
  step(Call::thread_start);
  return thread;
}

void join(Thread& thread) noexcept {
  step(Call::thread_join);
  while (!thread.has_ended) block(Call::thread_join, &thread, kForever, false);
  acquired(&thread);
}

pthread_t handle(const Thread& thread) noexcept { return thread.handle; }
int priority(const Thread& thread) noexcept { return thread.priority; }

bool Lock::take() noexcept {
  if (holder_ == nullptr || (is_recursive_ && holder_ == &self())) {
    holder_ = &self();
    ++depth_;
    acquired(this);
    return true;
  }
  return false;
}

bool Lock::try_lock() noexcept {
  step(Call::try_lock);
  return take();
}

bool Lock::lock_until(time_ns_t until_ns) noexcept {
  step(Call::lock);
  Thread& thread = self();
  while (!take()) {
    if (holder_ == &thread) return false;
    if (inherits_) let_inherit(thread, holder_);
    const bool is_woken = block(Call::lock, this, until_ns, false);
    if (inherits_) let_inherit(thread, nullptr);
    if (!is_woken) return take();
  }
  return true;
}

void Lock::release() noexcept {
  if (holder_ != &self()) fail("a thread unlocks a lock that it does not hold");
  if (--depth_ > 0) return;
  released(this);
  holder_ = nullptr;
  if (inherits_) {
    for (Thread* thread : all().alive) {
      if (thread->address == this) let_inherit(*thread, nullptr);
    }
  }
  wake_all(this);
}

void Lock::unlock() noexcept {
  release();
  step(Call::unlock);
}

bool Lock::is_held_here() const noexcept { return holder_ == &self(); }

void SharedLock::lock() noexcept {
  step(Call::lock);
  while (is_written_ || readers_ != 0) block(Call::lock, this, kForever, false);
  take();
}
bool SharedLock::try_lock() noexcept {
  step(Call::try_lock);
  if (is_written_ || readers_ != 0) return false;
  take();
  return true;
}
void SharedLock::take() noexcept {
  is_written_ = true;
  acquired(this);
  acquired(&readers_);
}
void SharedLock::unlock() noexcept {
  released(this);
  is_written_ = false;
  wake_all(this);
  step(Call::unlock);
}
void SharedLock::lock_shared() noexcept {
  step(Call::lock_shared);
  while (is_written_) block(Call::lock_shared, this, kForever, false);
  ++readers_;
  acquired(this);
}
bool SharedLock::try_lock_shared() noexcept {
  step(Call::try_lock);
  if (is_written_) return false;
  ++readers_;
  acquired(this);
  return true;
}
void SharedLock::unlock_shared() noexcept {
  released(&readers_);
  if (--readers_ == 0) wake_all(this);
  step(Call::unlock);
}

void fail(const std::string& what) noexcept {
  Scheduler& s = all();
  std::string text = "seed " + std::to_string(s.options.seed) + ", after " +
                     std::to_string((s.now_ns - kFirstInstant) / 1000) + " us: " + what + "\n";
  text += alive();
  std::fputs(text.c_str(), stderr);
  for (const Thread* thread : s.alive) {
    std::fprintf(stderr, "-- thread %d '%s'\n", thread->number, thread->name.data());
    pthread_kill(thread->handle, SIGUSR2);
    usleep(20'000);
  }
  std::abort();
}

}  // namespace mauve::seeds

namespace mauve {

using seeds::Call;

bool futex_wait_until(const Atomic<std::uint32_t>& word, std::uint32_t expected,
                      time_ns_t until_ns) noexcept {
  seeds::step(Call::futex_wait);
  if (word.system().load() != expected) return true;
  return seeds::block(Call::futex_wait, &word, until_ns, true);
}

void futex_wake_all(const Atomic<std::uint32_t>& word) noexcept {
  seeds::step(Call::futex_wake);
  seeds::wake_all(&word);
}

bool futex_lock_pi(Atomic<std::uint32_t>& word) noexcept {
  seeds::step(Call::futex_lock);
  seeds::Thread& self = seeds::self();
  const std::uint32_t found = word.system().load();
  if ((found & kFutexHolder) == 0) {
    word.system().store(self.id);
    seeds::acquired(&word);
    return true;
  }
  const seeds::Thread* holder = nullptr;
  for (const seeds::Thread* thread : seeds::all().alive) {
    if (thread->id == (found & kFutexHolder)) holder = thread;
  }
  if (holder == nullptr || holder == &self) return false;
  word.system().store(found | FUTEX_WAITERS);
  self.is_granted = false;
  seeds::let_inherit(self, holder);
  while (!self.is_granted) seeds::block(Call::futex_lock, &word, kForever, false);
  seeds::let_inherit(self, nullptr);
  seeds::acquired(&word);
  return true;
}

/// To the most urgent waiter.
bool futex_unlock_pi(Atomic<std::uint32_t>& word) noexcept {
  seeds::step(Call::futex_unlock);
  const seeds::Thread& self = seeds::self();
  if ((word.system().load() & kFutexHolder) != self.id) return false;
  seeds::released(&word);
  seeds::Thread* next = nullptr;
  std::uint32_t waiting = 0;
  for (seeds::Thread* thread : seeds::all().alive) {
    if (thread->address != &word) continue;
    ++waiting;
    if (next == nullptr || seeds::urgency(*thread) > seeds::urgency(*next)) next = thread;
  }
  if (next == nullptr) {
    word.system().store(0);
    return true;
  }
  word.system().store(next->id | (waiting > 1 ? FUTEX_WAITERS : 0));
  for (seeds::Thread* thread : seeds::all().alive) {
    if (thread->address == &word) seeds::let_inherit(*thread, thread != next ? next : nullptr);
  }
  next->is_granted = true;
  seeds::wake(*next);
  return true;
}

}  // namespace mauve

/// The kernel demotes threads by this function of the system; it finds this one first.
extern "C" int pthread_setschedparam(pthread_t handle, int policy, const sched_param* parameters) noexcept {
  for (mauve::seeds::Thread* thread : mauve::seeds::all().alive) {
    if (pthread_equal(thread->handle, handle) == 0) continue;
    thread->priority = policy == SCHED_FIFO ? parameters->sched_priority : 0;
    mauve::seeds::all().calm_until_ns = 0;
    return 0;
  }
  return ESRCH;
}

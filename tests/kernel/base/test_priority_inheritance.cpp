// SPDX-License-Identifier: LGPL-3.0-or-later
// Three priorities on one CPU: the highest waits for the lowest's lock, the middle one must not come between.
#include <pthread.h>
#include <sched.h>

#include <optional>

#include "mauve_rt/base/biased_mutex.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_priority_inheritance {

pthread_t make_thread(int priority, void* (*entry)(void*), void* argument) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  CPU_SET(0, &cpus);
  pthread_attr_setaffinity_np(&attributes, sizeof(cpus), &cpus);
  pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
  pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
  const sched_param scheduling{.sched_priority = priority};
  pthread_attr_setschedparam(&attributes, &scheduling);
  pthread_t thread{};
  EXPECT_EQ(0, pthread_create(&thread, &attributes, entry, argument));
  pthread_attr_destroy(&attributes);
  return thread;
}

void spin(time_ns_t duration) {
  const time_ns_t until = monotonic_now_ns() + duration;
  while (monotonic_now_ns() < until) {
  }
}

/// The lowest has a lock as everybody.
struct ByLock {
  void begin() { mutex.lock(); }
  void end() { mutex.unlock(); }
  PiMutex mutex;
};

/// It has the bias, and no lock at all: who waits gives it a priority to inherit.
struct ByBias {
  ByBias() { mutex.add(seat); }
  void begin() { hold.emplace(mutex, &seat); }
  void end() { hold.reset(); }
  BiasedMutex mutex;
  BiasedMutex::Seat seat;
  std::optional<BiasedMutex::Hold> hold;
};

/// The seat was of a thread that has ended; glibc gives its pthread_t to the next one, as in a second deployment.
struct ByBiasOfALaterThread : ByBias {
  ByBiasOfALaterThread() {
    const auto enter = [](void* way) -> void* {
      static_cast<ByBias*>(way)->begin();
      static_cast<ByBias*>(way)->end();
      return nullptr;
    };
    earlier = make_thread(10, enter, static_cast<ByBias*>(this));
    pthread_join(earlier, nullptr);
  }
  void begin() {
    if (pthread_equal(earlier, pthread_self()) == 0) GTEST_LOG_(INFO) << "another pthread_t";
    ByBias::begin();
  }
  pthread_t earlier{};
};

template <typename Way>
struct Scene {
  Way way;
  std::atomic<bool> low_holds{false};
  std::atomic<bool> high_waits{false};
  std::atomic<int> order{0};
  int high_came{0};
  int middle_came{0};
};

template <typename Way>
class PriorityInheritance : public ::testing::Test {};
using Ways = ::testing::Types<ByLock, ByBias, ByBiasOfALaterThread>;
TYPED_TEST_SUITE(PriorityInheritance, Ways, );

TYPED_TEST(PriorityInheritance, TheHighestIsServedBeforeTheMiddle) {
  using Scene = Scene<TypeParam>;
  if (!may_use_fifo()) GTEST_SKIP() << "needs the right to SCHED_FIFO (rtprio limit)";
  Scene scene;
  const pthread_t low = make_thread(
      10,
      [](void* argument) -> void* {
        auto& scene = *static_cast<Scene*>(argument);
        scene.way.begin();
        scene.low_holds = true;
        while (!scene.high_waits) sched_yield();
        spin(ms_to_ns(5));  // with the middle one ready to run, only an inherited priority gets this done
        scene.way.end();
        return nullptr;
      },
      &scene);
  while (!scene.low_holds) std::this_thread::yield();
  const pthread_t high = make_thread(
      30,
      [](void* argument) -> void* {
        auto& scene = *static_cast<Scene*>(argument);
        scene.high_waits = true;
        scene.way.mutex.lock();
        scene.high_came = ++scene.order;
        scene.way.mutex.unlock();
        return nullptr;
      },
      &scene);
  const pthread_t middle = make_thread(
      20,
      [](void* argument) -> void* {
        auto& scene = *static_cast<Scene*>(argument);
        spin(ms_to_ns(50));
        scene.middle_came = ++scene.order;
        return nullptr;
      },
      &scene);
  for (const pthread_t thread : {low, high, middle}) pthread_join(thread, nullptr);
  EXPECT_EQ(1, scene.high_came);
  EXPECT_EQ(2, scene.middle_came);
}

class Contention : public Deployed {};

TEST_F(Contention, IsTracedWithItsHolder) {
  PiMutex mutex;
  mutex.set_trace_id(TraceNames::intern("contended_mutex"));
  Component& component = add("c", 1);
  std::atomic<bool> ask{false};
  const ComponentsEndFirst guard(deployer);
  core(component).work = [&] {
    if (!ask.exchange(false)) return;
    mutex.lock();
    mutex.unlock();
  };
  deploy();
  mutex.lock();
  ask = true;
  wait_until([&] { return !ask; }, "the component to want the lock");
  std::this_thread::sleep_for(std::chrono::milliseconds(3));
  mutex.unlock();
  const int runs = core(component).runs;
  wait_runs(component, runs + 1);
  const auto contended = records_of(deployer.drain_trace(), TraceKind::contended);
  ASSERT_EQ(1U, contended.size());
  EXPECT_EQ(gettid(), contended[0].a);
  EXPECT_GT(contended[0].b, 0);
}

}  // namespace mauve::testing::test_priority_inheritance

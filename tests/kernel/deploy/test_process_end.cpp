// SPDX-License-Identifier: LGPL-3.0-or-later
// The end of a process by a signal: outputs first, waiting for nobody. Each case ends a process of its own.
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <filesystem>

#include "mauve_rt/deploy/process_end.hpp"

#include "fixtures.hpp"

/// Each case ends its process while threads are there.
// NOLINTNEXTLINE(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp): the name that ThreadSanitizer calls
extern "C" const char* __tsan_default_options();
// NOLINTNEXTLINE(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp)
extern "C" const char* __tsan_default_options() { return "report_thread_leaks=0"; }

namespace mauve::testing::test_process_end {

using ::testing::ExitedWithCode;

/// Components that write 42 in each period, in a process whose signals are blocked.
class Robot {
 public:
  Robot() {
    block_end_signals();
    for (const char* name : {"first", "second"}) {
      auto& component =
          architecture.add_component<TestShell, TestCore, TestFsm>(name, {.cpus = {kComponentsCpu}});
      outputs.push_back(&architecture.add_resource<SharedData<Number>>(std::string(name) + "_out"));
      architecture.connect(name, "output", std::string(name) + "_out", "write");
      auto& core = component.core_as<TestCore>();
      core.work = [&core] { core.exposed_shell().output.write({42.0}); };
    }
    architecture.configure();
    deployer.deploy();
    wait_until([&] { return all_are(42.0); }, "the outputs");
  }
  bool all_are(double expected) {
    return std::all_of(outputs.begin(), outputs.end(), [expected](SharedData<Number>* output) {
      Number value;
      time_ns_t time_ns = 0;
      ReaderState seen;
      output->read.read(value, time_ns, seen);
      return value.value == expected;
    });
  }
  /// From another thread, as from another process.
  static std::thread send(int signal) {
    return std::thread([signal] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      kill(getpid(), signal);
    });
  }

  AwayFromComponents away;
  Architecture architecture;
  std::vector<SharedData<Number>*> outputs;
  Deployer deployer{architecture};
};

class ProcessEnd : public ::testing::Test {
 protected:
  // A process of its own from the start: the threads of this one are not in a fork.
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

class EndSignal : public ProcessEnd, public ::testing::WithParamInterface<int> {};
INSTANTIATE_TEST_SUITE_P(Signals, EndSignal, ::testing::ValuesIn(kEndSignals));

TEST_P(EndSignal, MakesOutputsSafe) {
  const auto live = [&] {
    std::signal(GetParam(), SIG_DFL);  // whatever the parent process ignores
    Robot robot;
    std::thread sender = Robot::send(GetParam());
    const int signal = wait_end_signal();
    sender.join();
    const bool is_safe = robot.all_are(0.0) && !robot.deployer.is_deployed();
    const bool is_marked =
        std::ranges::all_of(robot.outputs, [](auto* output) { return output->stops() == 1; });
    _exit(signal == GetParam() && is_safe && is_marked ? 0 : 3);
  };
  EXPECT_EXIT(live(), ExitedWithCode(0), "");
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they map memory of their own

/// From now on the system gives this process neither a thread nor memory.
bool forbid_threads_and_memory() {
  constexpr std::array calls{__NR_clone, __NR_clone3, __NR_mmap, __NR_brk};
  std::vector<sock_filter> filter{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
  for (const int call : calls) {
    filter.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 1));
    filter.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EAGAIN));
  }
  filter.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  const sock_fprog program{.len = static_cast<unsigned short>(filter.size()), .filter = filter.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC, &program) == 0;
}

TEST_F(ProcessEnd, OutputsAreSafeWithoutAnotherThreadOrMoreMemory) {
  const auto live = [] {
    Robot robot;
    const auto threads = [] {
      return std::distance(std::filesystem::directory_iterator("/proc/self/task"), {});
    };
    const auto before = threads();
    std::thread sender([&] {
      constexpr int kOwn = 1;
      constexpr int kOfTheEnd = 2;
      wait_until([&] { return threads() == before + kOwn + kOfTheEnd; }, "the threads of the end");
      if (!forbid_threads_and_memory()) _exit(4);
      kill(getpid(), SIGTERM);
    });
    wait_end_signal({.dump_signal = SIGRTMIN});
    sender.join();
    _exit(robot.all_are(0.0) ? 0 : 3);
  };
  EXPECT_EXIT(live(), ExitedWithCode(0), "");
}

#endif

TEST_F(ProcessEnd, AComponentThatHangsIsGivenUp) {
  const auto live = [] {
    Robot robot;
    std::atomic<bool> hangs{false};
    Transaction change;
    auto fresh = std::make_unique<TestCore>();
    TestCore& hanging = *fresh;
    hanging.work = [&] {
      hanging.exposed_shell().output.write({42.0});
      hangs = true;
      for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
    };
    change.replace_core("first", std::move(fresh));
    robot.deployer.commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(10), .phase_ns = 0}});
    wait_until([&] { return hangs.load(); }, "the state that hangs");
    std::thread sender = Robot::send(SIGTERM);
    wait_end_signal({.grace_ns = s_to_ns(60)});
    sender.join();
    _exit(robot.all_are(0.0) ? 0 : 3);
  };
  EXPECT_EXIT(live(), ExitedWithCode(0), "");
}

TEST_F(ProcessEnd, NothingIsDeployedAfterIt) {
  const auto live = [] {
    Robot robot;
    if (Deployer::all_ended()) _exit(5);
    std::thread sender = Robot::send(SIGTERM);
    wait_end_signal();
    sender.join();
    if (!Deployer::all_ended()) _exit(6);
    Architecture other;
    other.configure();
    Deployer late(other);
    for (Deployer* each : {&robot.deployer, &late}) {
      try {
        each->deploy();
        _exit(3);
      } catch (const Error& error) {
        if (error.code() != ErrorCode::not_configured) _exit(4);
      }
    }
    _exit(0);
  };
  EXPECT_EXIT(live(), ExitedWithCode(0), "");
}

TEST_F(ProcessEnd, EndsAProcessThatHangs) {
  const auto live = [] {
    block_end_signals();
    std::signal(SIGRTMIN, [](int) {
      const char text[] = "here it is";
      static_cast<void>(!write(STDERR_FILENO, text, sizeof text - 1));
    });
    std::thread sender = Robot::send(SIGINT);
    wait_end_signal({.grace_ns = ms_to_ns(50), .status = 5, .dump_signal = SIGRTMIN});
    for (;;) pause();
  };
  EXPECT_EXIT(live(), ExitedWithCode(5), "did not end within 50 ms.*\nhere it is");
}

TEST_F(ProcessEnd, LeavesASignalIgnoredThatTheParentProcessIgnores) {
  const auto live = [] {
    std::signal(SIGHUP, SIG_IGN);
    Robot robot;
    kill(getpid(), SIGHUP);
    std::thread sender = Robot::send(SIGTERM);
    const int signal = wait_end_signal();
    sender.join();
    _exit(signal == SIGTERM ? 0 : 3);
  };
  EXPECT_EXIT(live(), ExitedWithCode(0), "");
}

}  // namespace mauve::testing::test_process_end

// SPDX-License-Identifier: LGPL-3.0-or-later
// Log lines: written by parts on any thread, taken with component, state and instant; the same on threads and in virtual time.
#include <cmath>
#include <thread>

#include "free_fsm.hpp"
#include "hosts.hpp"

namespace mauve::testing::test_log {

using ::testing::ElementsAre;

enum class Gait : std::uint8_t { walk = 3 };

template <typename... Args>
std::string text_of(LogFormat<std::type_identity_t<Args>...> format, const Args&... arguments) {
  LogQueue queue;
  LogSource source;
  source.set_up(std::shared_ptr<LogQueue>(&queue, [](LogQueue*) {}), LogLine::kNoComponent, 0);
  Log(&source).info(format, arguments...);
  const LogDrain drain = queue.drain();
  return drain.lines.size() == 1 ? drain.lines.front().text() : "(no line)";
}

TEST(LogText, HasEachArgumentInItsPlace) {
  EXPECT_EQ("tracking error 0.25 m", text_of("tracking error {} m", 0.25));
  EXPECT_EQ("0.1 -7 7 true 3", text_of("{} {} {} {} {}", 0.1, -7, 7U, true, Gait::walk));
  EXPECT_EQ("{0.250} 2e+06 1.5 ff", text_of("{{{:.3f}}} {:.0e} {:.3} {:x}", 0.25, 2e6, 1.5, 255));
  EXPECT_EQ("nan inf", text_of("{} {}", std::nan(""), HUGE_VAL));
  EXPECT_EQ("18446744073709551615 -9223372036854775808",
            text_of("{} {}", std::uint64_t{UINT64_MAX}, std::int64_t{INT64_MIN}));
  EXPECT_EQ("1 2 3 4 5 6 7 8", text_of("{} {} {} {} {} {} {} {}", 1, 2, 3, 4, 5, 6, 7, 8));
}

TEST(LogText, CutsTextsThatDoNotFit) {
  const std::string text(100, 'x');
  EXPECT_EQ("mode follow at 1", text_of("mode {} at {}", "follow", 1));
  EXPECT_EQ("", text_of("{}", std::string_view()));
  EXPECT_EQ(text.substr(0, 63), text_of("{}", text));
  EXPECT_EQ(text.substr(0, 55) + " 1", text_of("{} {}", text, 1));
  EXPECT_EQ(text.substr(0, 31) + " " + text.substr(0, 31), text_of("{} {}", text, text));
  EXPECT_EQ(text.substr(0, 7) + " 1 2 3 4 5 6 7",
            text_of("{} {} {} {} {} {} {} {}", text, 1, 2, 3, 4, 5, 6, 7));
}

TEST(LogQueue, CountsWhatFindsNoRoom) {
  LogQueue queue;
  const auto ring = queue.make_ring(4);
  const auto write = [&](std::size_t lines) {
    for (std::size_t line = 0; line < lines; ++line) {
      if (ring->begin_line() != nullptr) ring->end_line();
    }
  };
  write(LogRing::kCapacity + 3);
  for (std::size_t line = 0; line < LogQueue::kMostWaiting + 2; ++line) queue.add({});
  LogDrain drain = queue.drain();
  EXPECT_EQ(LogRing::kCapacity + LogQueue::kMostWaiting, drain.lines.size());
  ASSERT_EQ(2U, drain.lost.size());
  EXPECT_EQ(2U, drain.lost[0].lines);
  EXPECT_EQ(LogLine::kNoComponent, drain.lost[0].component);
  EXPECT_EQ(3U, drain.lost[1].lines);
  EXPECT_EQ(4, drain.lost[1].component);
  write(1);
  drain = queue.drain();
  EXPECT_EQ(1U, drain.lines.size());
  EXPECT_TRUE(drain.lost.empty()) << "each is told once";
}

TEST(LogQueue, TakesLinesOfManyThreadsWhileTheyWrite) {
  constexpr int kThreads = 3, kLines = 2000;
  const auto queue = std::make_shared<LogQueue>();
  LogSource source;
  source.set_up(queue, 1, 0);
  std::vector<std::thread> threads;
  std::atomic<int> running{kThreads};
  for (int number = 0; number < kThreads; ++number) {
    threads.emplace_back([&, ring = number == 0 ? nullptr : queue->make_ring(1)] {
      LogRing::set_for_this_thread(ring.get());
      for (int line = 0; line < kLines; ++line) Log(&source).info("{} {}", line, 0.5);
      LogRing::set_for_this_thread(nullptr);
      --running;
    });
  }
  std::uint64_t taken = 0, lost = 0;
  const auto take = [&] {
    const LogDrain drain = queue->drain();
    taken += drain.lines.size();
    for (const LogDrain::Lost& each : drain.lost) lost += each.lines;
  };
  while (running > 0) take();
  for (std::thread& thread : threads) thread.join();
  threads.clear();
  take();
  EXPECT_EQ(kThreads * kLines, taken + lost);
}

/// A service whose resource says what it was asked.
class Talking final : public Resource {
 public:
  Talking() : Resource("test/Talking", "") { offer(say); }

  class Say final : public CallService<void(int)> {
   public:
    explicit Say(Talking& owner) : CallService("say", "test/Say"), owner_(owner) {}
    void call(int number) override { owner_.log().error("asked {}", number); }

   private:
    Talking& owner_;
  };
  Say say{*this};

 private:
  bool configure_hook() override {
    log().info("ready");
    return true;
  }
};

struct TalkingShell : Shell {
  CallPort<void(int)>& say = call_port<void(int)>("say", "test/Say");
  using Shell::log;
};

struct TalkingCore : Core<TalkingShell> {
  void update() {
    log().debug("not kept");
    log().warn("run {} of {}", ++runs, 0.5);
    shell().log().info("shell");
    shell().say(runs);
  }
  bool configure_hook() override {
    log().info("core is ready");
    return true;
  }
  std::atomic<int> runs{0};
};

struct TalkingFsm : Fsm<TalkingShell, TalkingCore> {
  void define() override {
    State& run = execution("Run", "update", &TalkingCore::update);
    State& pause = wait("Pause", ms_to_ns(10));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

struct Told {
  std::string component, source, state, text;
  LogLevel level;
  time_ns_t time_ns;
};

template <typename Way>
class LogOnHost : public OnBothHosts<Way> {
 protected:
  Component& add_talking(const TaskSettings& settings = {}) {
    this->architecture.template add_resource<Talking>("talking");
    Component& component =
        this->architecture.template add_component<TalkingShell, TalkingCore, TalkingFsm>("c", settings);
    this->architecture.connect("c", "say", "talking", "say");
    return component;
  }
  void run_for(time_ns_t duration_ns) {
    this->host.run_for(duration_ns + std::max<time_ns_t>(0, (*this->host).epoch_ns() - this->host.now_ns()));
  }
  std::vector<Told> take() {
    const auto names = this->architecture.trace_components();
    const LogDrain drain = this->architecture.log_queue()->drain();
    EXPECT_TRUE(drain.lost.empty());
    std::vector<Told> all;
    for (const LogLine& line : drain.lines) {
      all.push_back({line.component < names.size() ? names[line.component] : "",
                     TraceNames::word(line.source), TraceNames::word(line.state), line.text(), line.level,
                     line.time_ns});
    }
    return all;
  }
  static std::vector<std::string> words(const std::vector<Told>& lines, std::size_t from, std::size_t to) {
    std::vector<std::string> words;
    for (std::size_t i = from; i < std::min(to, lines.size()); ++i) {
      const Told& line = lines[i];
      words.push_back(std::string(to_string(line.level)) + " " + line.component + "/" + line.source + "/" +
                      line.state + ": " + line.text);
    }
    return words;
  }
};
TYPED_TEST_SUITE(LogOnHost, EveryHost, HostNames);

TYPED_TEST(LogOnHost, TellsWhoWroteALineAndWhen) {
  this->add_talking();
  this->deploy();
  const time_ns_t epoch_ns = (*this->host).epoch_ns();
  this->run_for(ms_to_ns(25));
  this->host.shutdown();
  const std::vector<Told> lines = this->take();
  ASSERT_GE(lines.size(), 8U);
  EXPECT_THAT(this->words(lines, 0, 8),
              ElementsAre("info /talking/: ready", "info c//: core is ready", "warn c//Run: run 1 of 0.5",
                          "info c//Run: shell", "error c/talking/Run: asked 1", "warn c//Run: run 2 of 0.5",
                          "info c//Run: shell", "error c/talking/Run: asked 2"));
  EXPECT_LE(epoch_ns, lines[2].time_ns);
  EXPECT_LE(epoch_ns + ms_to_ns(10), lines[5].time_ns);
  if (TestFixture::is_virtual) {
    EXPECT_EQ(epoch_ns + ms_to_ns(10), lines[5].time_ns);
    EXPECT_GE(epoch_ns, lines[0].time_ns) << "what came before the simulation has its time, too";
  }
}

TYPED_TEST(LogOnHost, KeepsLinesFromItsLevelOn) {
  this->add_talking({.log_level = LogLevel::debug});
  this->deploy();
  this->run_for(ms_to_ns(15));
  EXPECT_EQ(LogLevel::debug, this->architecture.log_level("c"));
  this->architecture.set_log_level("c", LogLevel::fatal);
  this->architecture.set_log_level("talking", LogLevel::fatal);
  this->run_for(ms_to_ns(15));  // what was under way has ended
  std::vector<Told> lines = this->take();
  ASSERT_GE(lines.size(), 4U);
  EXPECT_EQ("debug c//Run: not kept", this->words(lines, 2, 3).front());
  this->run_for(ms_to_ns(25));
  EXPECT_TRUE(this->take().empty());
  this->architecture.set_log_level("c", LogLevel::warn);
  this->run_for(ms_to_ns(25));
  lines = this->take();
  ASSERT_FALSE(lines.empty());
  for (const Told& line : lines) EXPECT_EQ(LogLevel::warn, line.level);
  EXPECT_THROW(this->architecture.set_log_level("nobody", LogLevel::info), Error);
}

TYPED_TEST(LogOnHost, KeepsTheLastLinesOfARemovedComponent) {
  this->add_talking();
  this->deploy();
  this->run_for(ms_to_ns(15));
  this->host.stop("c");
  Transaction remove;
  remove.remove_component("c");
  this->host.commit(std::move(remove));
  EXPECT_GE(this->take().size(), 5U);
}

TEST(LogOnThreads, WritesWithoutAnAllocation) {
  if (allocation_counting() == AllocationCounting::none)
    GTEST_SKIP() << "a sanitizer counts allocations itself";
  Architecture architecture;
  architecture.add_resource<Talking>("talking");
  Component& component =
      architecture.add_component<TalkingShell, TalkingCore, TalkingFsm>("c", {.log_level = LogLevel::debug});
  architecture.connect("c", "say", "talking", "say");
  architecture.configure();
  Deployer deployer(architecture);
  deployer.deploy();
  wait_until([&] { return component.core_as<TalkingCore>().runs.load() > 40; },
             "4 lines in each of 40 releases");
  EXPECT_EQ(0U, component.task().counters().allocations());
  deployer.shutdown();
  EXPECT_FALSE(architecture.log_queue()->drain().lost.empty());
}

TEST(LogWithoutArchitecture, GoesNowhere) {
  TalkingCore core;
  TalkingShell shell;
  ASSERT_TRUE(core.bind_shell(shell));
  core.configure();
  EXPECT_EQ(0, core.runs);
}

}  // namespace mauve::testing::test_log

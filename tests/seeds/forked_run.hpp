// SPDX-License-Identifier: LGPL-3.0-or-later
// Runs a scenario under one seed in a child process, so that each run begins with the same memory.
#pragma once

#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/time.hpp"

#include "seeds/scheduler.hpp"

namespace mauve::seeds {

/// Of the environment; empty: it is not set.
inline std::string variable(const char* name) {
  const char* const text = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): no thread sets a variable
  return text != nullptr ? text : "";
}

/// What a scenario found to be wrong; empty: nothing.
class Findings {
 public:
  void expect(bool is_true, const std::string& otherwise) {
    if (!is_true)
      lines_.push_back("at " + std::to_string(now_ns() / 1000 - 1'000'000'000) + " us: " + otherwise);
  }
  /// What was done, for who reads a run that went wrong.
  void note(const std::string& what) {
    notes_.push_back(std::to_string(now_ns() / 1000 - 1'000'000'000) + " us, thread " + thread_name() + ": " +
                     what);
  }
  /// What happened, summed over all seeds: so that a scenario in which nothing happens is seen.
  void count(const std::string& what, int times = 1) { counts_[what] += times; }
  const std::map<std::string, int>& counts() const noexcept { return counts_; }
  const std::vector<std::string>& notes() const noexcept { return notes_; }
  const std::vector<std::string>& lines() const noexcept { return lines_; }

 private:
  static std::string thread_name() {
    char name[16]{};
    pthread_getname_np(pthread_self(), name, sizeof(name));
    return name;
  }

  std::vector<std::string> lines_;
  std::vector<std::string> notes_;
  std::map<std::string, int> counts_;
};

/// Of a scenario that is over: all threads but its own end within that time.
inline void expect_threads_end(Findings& findings, time_ns_t within_ns) {
  constexpr time_ns_t kBetween = ms_to_ns(1);
  for (time_ns_t waited_ns = 0; waited_ns < within_ns && outcome().alive > 1; waited_ns += kBetween)
    sleep_for(kBetween);
  findings.expect(outcome().alive == 1, "threads are left:\n" + alive());
}

struct Run {
  int status{0};  // of the child, as waitpid() has it
  Outcome outcome{};
  std::map<std::string, int> counts{};
  std::string text{};    // findings
  std::string errors{};  // standard error of the child
  bool is_good() const noexcept { return status == 0 && text.empty(); }
};

/// A contract that breaks in a component's own code makes the component FAULTED, as any exception there: the run itself goes on.
inline constexpr const char* kBrokenContract = ": broken ";

inline std::string line_with(const std::string& text, std::size_t at) {
  const std::size_t begin = text.rfind('\n', at) + 1;
  return text.substr(begin, text.find('\n', at) - begin);
}

/// The standard error of a child: kept in memory, and copied to the standard error of this process.
class ChildErrors {
 public:
  ChildErrors() : file_(memfd_create("errors", MFD_CLOEXEC)) {}
  ~ChildErrors() { close(file_); }
  ChildErrors(const ChildErrors&) = delete;
  ChildErrors& operator=(const ChildErrors&) = delete;

  void receive() const { dup2(file_, STDERR_FILENO); }
  std::string take() const {
    std::string text;
    char part[4096];
    lseek(file_, 0, SEEK_SET);
    for (ssize_t length = 0; (length = read(file_, part, sizeof(part))) > 0;)
      text.append(part, static_cast<std::size_t>(length));
    [[maybe_unused]] const ssize_t copied = write(STDERR_FILENO, text.data(), text.size());
    return text;
  }

 private:
  int file_;
};

/// `trace`: the file to write the calls to; empty: none.
template <typename Scenario>
Run run_forked(const Scenario& scenario, std::uint64_t seed, const std::string& trace = {}) {
  constexpr unsigned kLongestSeconds = 120;  // of the real clock: the child spins without a call of the seam
  static const bool is_prepared = (prepare_forks(), true);
  static_cast<void>(is_prepared);
  const ChildErrors errors;
  int ends[2];
  if (pipe(ends) != 0) return {.status = -1, .text = "no pipe"};
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    errors.receive();
    alarm(kLongestSeconds);
    mallopt(M_ARENA_MAX, 1);
    mallopt(M_PERTURB, 0xA5);  // the use of freed memory is seen
    cpu_set_t here;            // the baton is passed fastest on one processor
    CPU_ZERO(&here);
    CPU_SET(static_cast<std::size_t>(sched_getcpu()), &here);
    sched_setaffinity(0, sizeof(here), &here);
    Options options{.seed = seed, .longest_ns = 60'000'000'000, .keeps_trace = !trace.empty()};
    if (const std::string until_ms = variable("MAUVE_SEED_UNTIL_MS"); !until_ms.empty())
      options.longest_ns = std::stoll(until_ms) * 1'000'000;
    begin(options);
    Findings findings;
    try {
      scenario(seed, findings);
    } catch (const std::exception& error) {
      findings.expect(false, std::string("exception: ") + error.what());
    }
    const Outcome outcome = seeds::outcome();
    if (!trace.empty()) write_trace(trace);
    std::string text;
    for (const auto& [what, times] : findings.counts()) text += what + "=" + std::to_string(times) + "\n";
    text += "\n";
    for (const std::string& line : findings.lines().empty() ? std::vector<std::string>() : findings.notes())
      text += "  " + line + "\n";
    for (const std::string& line : findings.lines()) text += "  " + line + "\n";
    bool is_sent = write(ends[1], &outcome, sizeof(outcome)) == sizeof(outcome);
    is_sent = is_sent && write(ends[1], text.data(), text.size()) == static_cast<ssize_t>(text.size());
    _exit(is_sent ? 0 : 3);
  }
  close(ends[1]);
  Run run;
  if (read(ends[0], &run.outcome, sizeof(run.outcome)) == sizeof(run.outcome)) {
    char part[4096];
    for (ssize_t length = 0; (length = read(ends[0], part, sizeof(part))) > 0;)
      run.text.append(part, static_cast<std::size_t>(length));
  }
  while (!run.text.empty()) {  // first the counts, then an empty line
    const std::string line = run.text.substr(0, run.text.find('\n'));
    run.text.erase(0, line.size() + 1);
    if (line.empty()) break;
    run.counts[line.substr(0, line.find('='))] = std::stoi(line.substr(line.find('=') + 1));
  }
  close(ends[0]);
  waitpid(child, &run.status, 0);
  run.errors = errors.take();
  if (const std::size_t broken = run.errors.find(kBrokenContract); broken != std::string::npos)
    run.text += "  at the contract: " + line_with(run.errors, broken) + "\n";
  return run;
}

}  // namespace mauve::seeds

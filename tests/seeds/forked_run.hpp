// SPDX-License-Identifier: LGPL-3.0-or-later
// Runs a scenario under one seed in a child process, so that each run begins with the same memory.
#pragma once

#include <malloc.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "seeds/scheduler.hpp"

namespace mauve::seeds {

/// What a scenario found to be wrong; empty: nothing.
class Findings {
 public:
  void expect(bool is_true, const std::string& otherwise) {
    if (!is_true)
      lines_.push_back("at " + std::to_string(now_ns() / 1000 - 1'000'000'000) + " us: " + otherwise);
  }
  const std::vector<std::string>& lines() const noexcept { return lines_; }

 private:
  std::vector<std::string> lines_;
};

struct Run {
  int status{0};  // of the child, as waitpid() has it
  Outcome outcome{};
  std::string text{};  // findings
  bool is_good() const noexcept { return status == 0 && text.empty(); }
};

/// `trace`: the file to write the calls to; empty: none.
template <typename Scenario>
Run run_forked(const Scenario& scenario, std::uint64_t seed, const std::string& trace = {}) {
  constexpr unsigned kLongestSeconds = 120;  // of the real clock: the child spins without a call of the seam
  int ends[2];
  if (pipe(ends) != 0) return {.status = -1, .text = "no pipe"};
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    alarm(kLongestSeconds);
    mallopt(M_ARENA_MAX, 1);
    cpu_set_t here;  // the baton is passed fastest on one processor
    CPU_ZERO(&here);
    CPU_SET(static_cast<std::size_t>(sched_getcpu()), &here);
    sched_setaffinity(0, sizeof(here), &here);
    begin({.seed = seed, .keeps_trace = !trace.empty()});
    Findings findings;
    try {
      scenario(seed, findings);
    } catch (const std::exception& error) {
      findings.expect(false, std::string("exception: ") + error.what());
    }
    const Outcome outcome = seeds::outcome();
    if (!trace.empty()) write_trace(trace);
    std::string text;
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
  close(ends[0]);
  waitpid(child, &run.status, 0);
  return run;
}

}  // namespace mauve::seeds

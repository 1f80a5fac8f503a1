// SPDX-License-Identifier: LGPL-3.0-or-later
// Whether the seeds find planted faults: runs the seeds with one mutant after the other, each up to the first bad run.
// MAUVE_MUTANT asks for one number or for a range (17, 1-20), MAUVE_SEEDS for so many seeds, MAUVE_SCENARIO for
// one scenario, MAUVE_WRITE_FOUND for a new found.txt.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "forked_run.hpp"
#include "scenarios.hpp"
#include "seeds/planted.hpp"

namespace mauve::testing::test_mutants {

using seeds::Run;

struct Mutant {
  int number;
  const char* name;
};

constexpr std::array kMutants = std::to_array<Mutant>({
#include "planted_mutants.inc"
});

constexpr std::uint64_t kMostSeeds =
    10'000;  // the list of a mutant that needs more is of no use to who changes the kernel
constexpr std::uint64_t kGoodSeeds = 300;  // of the sources as they are

/// What was wrong with a run, in one line.
std::string reason(const Run& run) {
  const std::string& errors = run.errors;
  if (const std::size_t broken = errors.find(seeds::kBrokenContract); broken != std::string::npos)
    return seeds::line_with(errors, broken);
  std::istringstream findings(run.text);
  for (std::string line; std::getline(findings, line);) {
    if (line.starts_with("  at ")) return line.substr(2);
  }
  std::istringstream lines(errors);
  std::string line;
  const auto is_of_stack = [&] { return line.find(")[0x") != std::string::npos; };  // a path and an address
  while (std::getline(lines, line) && is_of_stack()) {
  }
  if (is_of_stack()) line.clear();
  if (line.starts_with("terminate called")) {
    const std::size_t what = errors.find("what():");
    if (what != std::string::npos) line = seeds::line_with(errors, what);
  }
  if (WIFSIGNALED(run.status)) {
    const std::string signal = std::string("SIG") + sigabbrev_np(WTERMSIG(run.status));
    return line.empty() ? signal : signal + ": " + line;
  }
  return line.empty() ? "status " + std::to_string(run.status) : line;
}

struct Found {
  std::uint64_t seed{0};  // 0: none
  std::string reason{};
  long reached{0};  // how often the runs came to the mutant
};

/// Runs one scenario; empty: nothing was wrong.
std::string fault_of(const SeedScenario& scenario, std::uint64_t seed) {
  const Run run = seeds::run_forked(scenario.run, seed);
  return run.is_good() ? "" : std::string(scenario.name) + ": " + reason(run);
}

/// Of one scenario (MAUVE_SCENARIO), or of all.
bool is_asked(const SeedScenario& scenario) {
  const std::string asked = seeds::variable("MAUVE_SCENARIO");
  return asked.empty() || asked == scenario.name;
}

/// The first seed of which the run of a scenario is bad with this mutant.
Found find(int number, std::uint64_t seeds) {
  seeds::planted_number = number;
  *seeds::reached = 0;
  Found found;
  for (std::uint64_t seed = 1; seed <= seeds && found.seed == 0; ++seed) {
    for (const SeedScenario& scenario : kScenarios) {
      if (!is_asked(scenario)) continue;
      const std::string fault = fault_of(scenario, seed);
      if (fault.empty()) continue;
      found = {.seed = seed, .reason = fault};
      break;
    }
  }
  seeds::planted_number = 0;
  found.reached = *seeds::reached;
  if (found.seed == 0 && number != 0) {
    found.reason =
        (found.reached == 0 ? "never reached" : "reached " + std::to_string(found.reached) + " times") +
        " in " + std::to_string(seeds) + " seeds";
  }
  return found;
}

std::string row(const Mutant& mutant, const Found& found) {
  constexpr std::size_t kLongest = 160;
  std::ostringstream text;
  text.width(3);
  text << mutant.number << "  ";
  text.width(48);
  text << std::left << mutant.name << "  ";
  text.width(9);
  text << std::right << (found.seed != 0 ? std::to_string(found.seed) : "not found") << "  "
       << found.reason.substr(0, kLongest);
  std::string line = text.str();
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

constexpr const char* kHeader =
    "# Written by test_mutants (MAUVE_WRITE_FOUND=1). Mutant, name, after how many seeds it was found, by "
    "what.\n";

/// The rows of found.txt, by number.
std::map<int, std::string> read_found() {
  std::map<int, std::string> rows;
  std::ifstream file(MAUVE_FOUND);
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line.front() != '#') rows[std::stoi(line)] = line;
  }
  return rows;
}

/// Several of this program may run at once, each for a range.
class FoundLock {
 public:
  FoundLock() : file_(open(MAUVE_FOUND, O_CREAT | O_RDWR | O_CLOEXEC, 0644)) { flock(file_, LOCK_EX); }
  ~FoundLock() { close(file_); }
  FoundLock(const FoundLock&) = delete;
  FoundLock& operator=(const FoundLock&) = delete;

 private:
  int file_;
};

void write_found(const std::map<int, std::string>& rows) {
  std::ofstream file(MAUVE_FOUND);
  file << kHeader;
  for (const auto& [number, row] : rows) {
    for (const Mutant& mutant : kMutants) {
      if (mutant.number == number) file << row << "\n";
    }
  }
}

/// Memory that the children have in common with this process.
void share_reached() {
  void* const page = mmap(nullptr, sizeof(long), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (page != MAP_FAILED) seeds::reached = static_cast<long*>(page);
}

int run() {
  share_reached();
  if (std::freopen("/dev/null", "w", stderr) == nullptr) return 1;  // a bad run copies its errors there
  int first = 0;
  int last = kMutants.empty() ? 0 : kMutants.back().number;
  if (const std::string asked = seeds::variable("MAUVE_MUTANT"); !asked.empty()) {
    first = last = std::stoi(asked);
    if (const std::size_t dash = asked.find('-'); dash != std::string::npos)
      last = std::stoi(asked.substr(dash + 1));
  }
  const std::string asked = seeds::variable("MAUVE_SEEDS");
  const std::uint64_t seeds = asked.empty() ? kMostSeeds : std::stoull(asked);
  const bool writes = !seeds::variable("MAUVE_WRITE_FOUND").empty();
  int failures = 0;
  if (first == 0) {
    const Found found = find(0, kGoodSeeds);
    std::printf("%s\n", row({0, "no fault planted"}, found).c_str());
    if (found.seed != 0) return 1;  // nothing that follows would say anything
  }
  for (const Mutant& mutant : kMutants) {
    if (mutant.number < first || mutant.number > last) continue;
    const Found found = find(mutant.number, seeds);
    const std::string line = row(mutant, found);
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
    failures += found.seed == 0 ? 1 : 0;
    if (writes) {
      const FoundLock lock;
      std::map<int, std::string> rows = read_found();
      rows[mutant.number] = line;
      write_found(rows);
    }
  }
  const std::map<int, std::string> rows = read_found();
  int unlisted = 0;
  for (const Mutant& mutant : kMutants) {
    const bool is_asked = mutant.number >= first && mutant.number <= last;
    unlisted += is_asked && !rows.contains(mutant.number) ? 1 : 0;
  }
  if (unlisted != 0)
    std::printf("%d mutants are not in found.txt. Run test_mutants with MAUVE_WRITE_FOUND=1.\n", unlisted);
  std::printf("%d mutants were not found\n", failures);
  return failures + unlisted == 0 ? 0 : 1;
}

}  // namespace mauve::testing::test_mutants

int main() { return mauve::testing::test_mutants::run(); }

// SPDX-License-Identifier: LGPL-3.0-or-later
// An ordinary thread that never rests on each CPU, for measurements of other processes.
//   bench_busy [--cpus 2]
// Prints a line once the threads run, and ends with its standard input.
#include <iostream>
#include <string>

#include "support/busy.hpp"
#include "support/options.hpp"

namespace {

void keep_busy(const bench::Options& options) {
  const bench::BusyLoops busy(static_cast<int>(options.number("cpus", 2)));
  std::cout << "busy" << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
  }
}

}  // namespace

int main(int count, char** words) { return bench::run_program(count, words, keep_busy); }

// SPDX-License-Identifier: LGPL-3.0-or-later
// The command line of a benchmark program: pairs of --name value.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>

namespace bench {

/// Whom a program measures: what this project offers, or the bare system calls beside it.
enum class Who { component, bare };

class Options {
 public:
  Options(int count, char** words) {
    for (int i = 1; i + 1 < count; i += 2) {
      const std::string name = words[i];
      if (!name.starts_with("--")) fail("expected --name value, found " + name);
      values_[name.substr(2)] = words[i + 1];
    }
    if (count % 2 == 0) fail(std::string("no value follows ") + words[count - 1]);
  }

  std::int64_t number(const std::string& name, std::int64_t otherwise) const {
    const auto found = values_.find(name);
    if (found == values_.end()) return otherwise;
    try {
      return std::stoll(found->second);
    } catch (const std::exception&) {
      fail("--" + name + ": expected a number, found " + found->second);
    }
  }
  std::string text(const std::string& name, const std::string& otherwise) const {
    const auto found = values_.find(name);
    return found == values_.end() ? otherwise : found->second;
  }
  Who who() const {
    const std::string word = text("who", "component");
    if (word != "component" && word != "bare") fail("--who: expected component or bare, found " + word);
    return word == "component" ? Who::component : Who::bare;
  }

  // What nearly every program takes.

  int priority() const { return static_cast<int>(number("priority", 80)); }
  int cpu() const { return static_cast<int>(number("cpu", 0)); }
  std::uint64_t seed() const { return static_cast<std::uint64_t>(number("seed", 1)); }

 private:
  [[noreturn]] static void fail(const std::string& text) {
    std::cerr << text << '\n';
    std::exit(2);  // NOLINT(concurrency-mt-unsafe): no thread exists yet
  }

  std::map<std::string, std::string> values_;
};

/// main() of a benchmark program: a failure is one line and exit status 1.
template <typename Body>
int run_program(int count, char** words, Body&& body) {
  try {
    const Options options(count, words);
    body(options);
    return 0;
  } catch (const std::exception& failure) {
    std::cerr << words[0] << ": " << failure.what() << '\n';
    return 1;
  }
}

/// The same of a program with two sides: makes the settings of the options, then measures the side that --who
/// names.
template <typename Settings>
int run_sides(int count, char** words, void (*component)(const Settings&), void (*bare)(const Settings&)) {
  return run_program(count, words, [&](const Options& options) {
    const Settings settings(options);
    (options.who() == Who::component ? component : bare)(settings);
  });
}

}  // namespace bench

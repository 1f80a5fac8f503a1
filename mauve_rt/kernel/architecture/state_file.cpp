// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/state_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <system_error>
#include <utility>

#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

constexpr std::string_view kFirstLine = "mauve_rt state 1\n";
constexpr std::string_view kSum = "sum ";
constexpr std::size_t kSumDigits = 16;
constexpr std::string_view kHex = "0123456789abcdef";

/// FNV-1a: another byte at one place is always another sum.
std::uint64_t sum_of(std::string_view text) {
  std::uint64_t sum = 0xcbf29ce484222325U;
  for (const char each : text) sum = (sum ^ static_cast<unsigned char>(each)) * 0x100000001b3U;
  return sum;
}

std::string sum_line(std::string_view text) {
  std::string line(kSum);
  const std::uint64_t sum = sum_of(text);
  for (std::size_t digit = kSumDigits; digit-- > 0;) line += kHex[(sum >> (4 * digit)) & 0xfU];
  return line + '\n';
}

// ---- writing

std::string in_quotes(std::string_view text) {
  std::string all = "\"";
  for (const char each : text) {
    const auto byte = static_cast<unsigned char>(each);
    if (each == '"' || each == '\\') {
      all += '\\';
      all += each;
    } else if (byte < 0x20 || byte == 0x7f) {
      all += "\\x";
      all += kHex[byte >> 4U];
      all += kHex[byte & 0xfU];
    } else {
      all += each;
    }
  }
  return all + '"';
}

template <typename Number>
std::string digits(Number number) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}

std::string words_of(bool value) { return value ? "true" : "false"; }

std::string value_text(const std::optional<PropertyValue>& value) {
  if (!value) return "none";
  if (const auto* truth = std::get_if<bool>(&*value)) return words_of(*truth);
  if (const auto* whole = std::get_if<std::int64_t>(&*value)) return "int " + digits(*whole);
  if (const auto* real = std::get_if<double>(&*value)) return "real " + digits(*real);
  return "text " + in_quotes(std::get<std::string>(*value));
}

std::string step_text(const Assignment& step) {
  return step.kind + " " + in_quotes(step.target) + " " + in_quotes(step.name) + " " + value_text(step.value);
}

std::string assigned_text(const char* record, const Assigned& one) {
  const auto& [element, step] = one;
  return std::string(record) + " " + in_quotes(element.target) + " " + in_quotes(element.name) + " " +
         step_text(step);
}

// ---- reading

[[noreturn]] void damaged(const std::string& found, std::size_t line = 0) {
  throw Error(ErrorCode::invalid_argument, "the state file is damaged",
              {.element = line != 0 ? "line " + std::to_string(line) : "",
               .expected = "what an executor of this version wrote",
               .found = found});
}

/// The words of one line.
class Words {
 public:
  Words(std::string_view line, std::size_t number) : left_(line), number_(number) {}

  std::string word() {
    const std::string_view found = left_.substr(0, left_.find(' '));
    if (found.empty()) fail();
    left_.remove_prefix(std::min(found.size() + 1, left_.size()));
    return std::string(found);
  }

  std::string text() {
    std::string found;
    if (take() != '"') fail();
    for (char each = take(); each != '"'; each = take()) found += each != '\\' ? each : escaped();
    if (!left_.empty() && take() != ' ') fail();
    return found;
  }

  bool truth() { return truth_of(word()); }

  template <typename Number>
  Number number() {
    const std::string found = word();
    Number value{};
    const auto [end, error] = std::from_chars(found.data(), found.data() + found.size(), value);
    if (error != std::errc() || end != found.data() + found.size()) fail();
    return value;
  }

  std::optional<PropertyValue> value() {
    const std::string kind = word();
    if (kind == "none") return std::nullopt;
    if (kind == "int") return number<std::int64_t>();
    if (kind == "real") return number<double>();
    if (kind == "text") return text();
    return truth_of(kind);
  }

  Assignment step() {
    Assignment found{.kind = word(), .target = text(), .name = text()};
    found.value = value();
    return found;
  }

  Assigned assigned() {
    Element element{.target = text(), .name = text()};
    return {.element = std::move(element), .step = step()};
  }

  bool is_at_end() const { return left_.empty(); }
  [[noreturn]] void fail() const { damaged("something else", number_); }

 private:
  char take() {
    if (left_.empty()) fail();
    const char first = left_.front();
    left_.remove_prefix(1);
    return first;
  }

  char escaped() {
    const char first = take();
    if (first != 'x') return first;
    const std::size_t high = kHex.find(take());
    const std::size_t low = kHex.find(take());
    if (high == std::string_view::npos || low == std::string_view::npos) fail();
    return static_cast<char>(high * 16 + low);
  }

  bool truth_of(const std::string& word) const {
    if (word != "true" && word != "false") fail();
    return word == "true";
  }

  std::string_view left_;
  std::size_t number_;
};

OverlaySpec overlay_of(Words& words) {
  OverlaySpec spec{.rule = words.text(), .source = words.text()};
  spec.priority = words.number<std::int64_t>();
  spec.safety = words.truth();
  spec.whole = words.truth();
  spec.latch = words.truth();
  spec.leaves_over_persons = words.truth();
  return spec;
}

KeptBase base_of(Words& words) {
  KeptBase base{.assigned = words.assigned(), .author = words.text(), .of_file = std::nullopt};
  if (!words.is_at_end()) base.of_file = words.step();
  return base;
}

void read_record(KeptState& state, Words words) {
  const std::string record = words.word();
  const bool is_of_rule = record == "assigns" || record == "leaves";
  if (is_of_rule && state.active.empty()) words.fail();
  if (record == "rule") {
    state.active.push_back(overlay_of(words));
  } else if (is_of_rule) {
    OverlaySpec& rule = state.active.back();
    (record == "assigns" ? rule.assigns : rule.leaves).push_back(words.assigned());
  } else if (record == "rejected") {
    state.rejected.push_back(words.assigned());
  } else if (record == "base") {
    state.bases.push_back(base_of(words));
  } else {
    words.fail();
  }
  if (!words.is_at_end()) words.fail();
}

// ---- the file system

/// An open file or folder.
class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags) : number_(::open(path.c_str(), flags, 0644)) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  bool is_open() const { return number_ >= 0; }
  bool write(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t written = ::write(number_, text.data(), text.size());
      if (written < 0 && errno != EINTR) return false;
      if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
  }
  bool read(std::string& text) const {
    std::array<char, 4096> part{};
    for (;;) {
      const ssize_t got = ::read(number_, part.data(), part.size());
      if (got == 0) return true;
      if (got < 0 && errno != EINTR) return false;
      if (got > 0) text.append(part.data(), static_cast<std::size_t>(got));
    }
  }
  bool sync() const { return ::fsync(number_) == 0; }

 private:
  int number_;
};

[[noreturn]] void fail_to_write(const std::filesystem::path& path, int error) {
  throw Error(ErrorCode::io, "the state file cannot be written",
              {.element = path.string(),
               .expected = "a folder in which files can be written",
               .found = std::generic_category().message(error),
               .remedy = "make room or give the executor the right to write there"});
}

}  // namespace

std::string text_of(const KeptState& state) {
  std::string text(kFirstLine);
  for (const OverlaySpec& rule : state.active) {
    text += "rule " + in_quotes(rule.rule) + " " + in_quotes(rule.source) + " " + digits(rule.priority);
    for (const bool flag : {rule.safety, rule.whole, rule.latch, rule.leaves_over_persons})
      text += " " + words_of(flag);
    text += '\n';
    for (const Assigned& one : rule.assigns) text += assigned_text("assigns", one) + '\n';
    for (const Assigned& one : rule.leaves) text += assigned_text("leaves", one) + '\n';
  }
  for (const Assigned& one : state.rejected) text += assigned_text("rejected", one) + '\n';
  for (const KeptBase& base : state.bases) {
    text += assigned_text("base", base.assigned) + " " + in_quotes(base.author);
    if (base.of_file) text += " " + step_text(*base.of_file);
    text += '\n';
  }
  return text + sum_line(text);
}

KeptState kept_state_of(std::string_view text) {
  if (!text.starts_with(kFirstLine)) damaged("another first line", 1);
  const std::size_t sum_bytes = kSum.size() + kSumDigits + 1;
  if (text.size() < kFirstLine.size() + sum_bytes) damaged("too few lines");
  std::string_view records = text.substr(0, text.size() - sum_bytes);
  if (text.substr(records.size()) != sum_line(records)) damaged("another sum in the last line");
  KeptState state;
  records.remove_prefix(kFirstLine.size());
  for (std::size_t line = 2; !records.empty(); ++line) {
    const std::size_t end = records.find('\n');
    if (end == std::string_view::npos) damaged("a line without an end", line);
    read_record(state, Words(records.substr(0, end), line));
    records.remove_prefix(end + 1);
  }
  return state;
}

std::optional<KeptState> read_state_file(const std::filesystem::path& path) {
  const Descriptor file(path, O_RDONLY | O_CLOEXEC);
  if (!file.is_open() && errno == ENOENT) return std::nullopt;
  std::string text;
  if (!file.is_open() || !file.read(text)) damaged(std::generic_category().message(errno));
  return kept_state_of(text);
}

void write_state_file(const std::filesystem::path& path, std::string_view text) {
  const std::filesystem::path folder = path.parent_path();
  std::error_code created;
  std::filesystem::create_directories(folder, created);
  if (created) fail_to_write(path, created.value());
  std::filesystem::path beside = path;
  beside += ".new";
  {
    const Descriptor file(beside, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC);
    if (!file.is_open() || !file.write(text) || !file.sync()) {
      const int error = errno;
      ::unlink(beside.c_str());
      fail_to_write(path, error);
    }
  }
  if (std::rename(beside.c_str(), path.c_str()) != 0) fail_to_write(path, errno);
  const Descriptor directory(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (!directory.is_open() || !directory.sync()) fail_to_write(path, errno);
}

}  // namespace mauve

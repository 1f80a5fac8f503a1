// SPDX-License-Identifier: LGPL-3.0-or-later
#include "console.hpp"

#include <rcutils/logging.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdarg>
#include <cstdio>
#include <deque>
#include <mutex>
#include <string>

#include "thread.hpp"

namespace mauve::bridge {

namespace {

constexpr std::size_t kMostLines = 1000;
constexpr std::size_t kMostBytes = std::size_t{1} << 20U;  // of these lines
constexpr std::size_t kLongest = std::size_t{64} * 1024;   // characters of one line

struct ConsoleLine {
  LinePlace place{};
  int severity{0};
  std::string name{};
  rcutils_time_point_value_t time_ns{0};
  std::string text{};

  std::size_t bytes() const noexcept {
    return place.function.size() + place.file.size() + name.size() + text.size();
  }
};

rcutils_log_location_t location_of(const LinePlace& place) {
  return {
      .function_name = place.function.c_str(), .file_name = place.file.c_str(), .line_number = place.number};
}

void write_line(const ConsoleLine& line, const char* format, ...) {
  const rcutils_log_location_t location = location_of(line.place);
  va_list arguments;
  va_start(arguments, format);
  rcutils_logging_console_output_handler(&location, line.severity, line.name.c_str(), line.time_ns, format,
                                         &arguments);
  va_end(arguments);
}

std::string formatted(const char* format, va_list* arguments) {
  std::array<char, 1024> usual;
  va_list again;
  va_copy(again, *arguments);
  const int wanted = std::vsnprintf(usual.data(), usual.size(), format, *arguments);
  std::string text;
  if (wanted >= 0 && static_cast<std::size_t>(wanted) < usual.size()) {
    text.assign(usual.data(), static_cast<std::size_t>(wanted));
  } else if (wanted >= 0) {
    text.resize(std::min(static_cast<std::size_t>(wanted), kLongest) + 1);
    std::vsnprintf(text.data(), text.size(), format, again);
    text.pop_back();
  }
  va_end(again);
  return text;
}

/// | member                 | written by          | read by | under  |
/// | ---------------------- | ------------------- | ------- | ------ |
/// | lines_ ... is_writing_ | who logs, the writer | same   | mutex_ |
class ConsoleQueue {
 public:
  void add(ConsoleLine line) {
    const std::lock_guard lock(mutex_);
    if (lines_.size() >= kMostLines || bytes_ + line.bytes() > kMostBytes) {
      ++dropped_;
      return;
    }
    bytes_ += line.bytes();
    lines_.push_back(std::move(line));
    changed_.notify_all();
  }
  bool flush(time_ns_t timeout_ns) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::nanoseconds(timeout_ns),
                             [this] { return lines_.empty() && !is_writing_; });
  }
  [[noreturn]] void write_all() {
    std::unique_lock lock(mutex_);
    std::uint64_t reported = 0;
    for (;;) {
      changed_.wait(lock, [&] { return !lines_.empty() || dropped_ != reported; });
      ConsoleLine line;
      if (lines_.empty()) {
        line = report(dropped_ - reported);
        reported = dropped_;
      } else {
        line = std::move(lines_.front());
        lines_.pop_front();
        bytes_ -= line.bytes();
      }
      is_writing_ = true;
      lock.unlock();
      write_line(line, "%s", line.text.c_str());
      lock.lock();
      is_writing_ = false;
      changed_.notify_all();
    }
  }

 private:
  static ConsoleLine report(std::uint64_t dropped) {
    ConsoleLine line{.severity = RCUTILS_LOG_SEVERITY_WARN, .name = "console", .time_ns = realtime_now_ns()};
    line.text = std::to_string(dropped) + (dropped == 1 ? " line was" : " lines were") +
                " left out: the terminal or pipe was not read for a while";
    return line;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<ConsoleLine> lines_;
  std::size_t bytes_{0};
  std::uint64_t dropped_{0};
  bool is_writing_{false};
};

/// Not destroyed with static objects: its thread may be in the middle of a line.
ConsoleQueue& console_queue() {
  static auto* const all = new ConsoleQueue;
  return *all;
}

rcutils_logging_output_handler_t other_handlers = nullptr;  // they get each line as well; set by start()

void log_line(const rcutils_log_location_t* location, int severity, const char* name,
              rcutils_time_point_value_t time_ns, const char* format, va_list* arguments) {
  va_list again;
  va_copy(again, *arguments);
  other_handlers(location, severity, name, time_ns, format, arguments);
  ConsoleLine line{.severity = severity, .name = name != nullptr ? name : "", .time_ns = time_ns};
  if (location != nullptr) {
    line.place = {.function = location->function_name != nullptr ? location->function_name : "",
                  .file = location->file_name != nullptr ? location->file_name : "",
                  .number = location->line_number};
  }
  line.text = formatted(format, &again);
  va_end(again);
  console_queue().add(std::move(line));
}

void write_through(const rcutils_log_location_t& location, int severity, const char* name,
                   rcutils_time_point_value_t time_ns, const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  if (const auto handler = rcutils_logging_get_output_handler())
    handler(&location, severity, name, time_ns, format, &arguments);
  va_end(arguments);
}

}  // namespace

void Console::write(int severity, const std::string& name, time_ns_t time_ns, const std::string& text,
                    const LinePlace& place) {
  write_through(location_of(place), severity, name.c_str(), time_ns, "%s", text.c_str());
}

void Console::start() {
  if (other_handlers != nullptr) return;
  other_handlers = rcutils_logging_get_output_handler();
  start_thread("console", [] { console_queue().write_all(); }).detach();
  rcutils_logging_set_output_handler(&log_line);
}

bool Console::flush(time_ns_t timeout_ns) noexcept { return console_queue().flush(timeout_ns); }

}  // namespace mauve::bridge

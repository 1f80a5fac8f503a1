// SPDX-License-Identifier: LGPL-3.0-or-later
#include "log.hpp"

#include <unordered_set>

namespace mauve::bindings {

namespace {

constexpr std::size_t kMostFormats = 4096;

/// The format as lines keep it: for the life of the process. nullptr: there are too many different ones. Under the interpreter's
/// lock.
const char* kept_format(const std::string& format) {
  static auto* const formats = new std::unordered_set<std::string>;
  if (const auto found = formats->find(format); found != formats->end()) return found->c_str();
  if (formats->size() >= kMostFormats) return nullptr;
  return formats->insert(format).first->c_str();
}

bool is_number(const py::handle& argument) {
  return py::isinstance<py::int_>(argument) || py::isinstance<py::float_>(argument);  // a bool is an int
}

std::size_t texts_in(const py::args& arguments, std::size_t count) {
  std::size_t texts = 0;
  for (std::size_t number = 0; number < count; ++number) texts += is_number(arguments[number]) ? 0 : 1;
  return texts;
}

void add_argument(LogLine& line, std::size_t number, const py::handle& argument, std::size_t places) {
  if (py::isinstance<py::bool_>(argument)) return line.add(number, argument.cast<bool>());
  if (py::isinstance<py::float_>(argument)) return line.add(number, argument.cast<double>());
  if (!py::isinstance<py::int_>(argument))
    return line.add_text(number, py::str(argument).cast<std::string>(), places);
  int overflow = 0;
  const long long integer = PyLong_AsLongLongAndOverflow(argument.ptr(), &overflow);
  if (overflow == 0) return line.add(number, static_cast<std::int64_t>(integer));
  const double wide = PyLong_AsDouble(argument.ptr());
  if (PyErr_Occurred() != nullptr) PyErr_Clear();  // larger than any double
  line.add(number, wide);
}

/// A line as Python has it.
struct LogEntry {
  time_ns_t time_ns{0};
  std::string level{};
  std::string component{};
  std::string source{};
  std::string state{};
  std::string text{};
  std::string format{};
  std::string function{};
  std::string file{};
  std::uint32_t line{0};
};

struct LogEntries {
  std::vector<LogEntry> lines;
  std::vector<std::pair<std::string, std::uint64_t>> lost;
};

LogEntries take_log(Architecture& architecture) {
  const LogDrain drain = architecture.log_queue()->drain();
  LogEntries all;
  if (drain.lines.empty() && drain.lost.empty()) return all;
  const std::vector<std::string> names = architecture.trace_components();
  const auto name_of = [&](std::uint16_t number) { return number < names.size() ? names[number] : ""; };
  for (const LogLine& line : drain.lines) {
    all.lines.push_back({.time_ns = line.time_ns,
                         .level = std::string(to_string(line.level)),
                         .component = name_of(line.component),
                         .source = TraceNames::word(line.source),
                         .state = TraceNames::word(line.state),
                         .text = line.text(),
                         .format = line.format,
                         .function = line.place.function_name(),
                         .file = line.place.file_name(),
                         .line = line.place.line()});
  }
  for (const LogDrain::Lost& lost : drain.lost) all.lost.emplace_back(name_of(lost.component), lost.lines);
  return all;
}

LogLevel require_level(const std::string& name) {
  if (const auto level = find_log_level(name)) return *level;
  throw Error(ErrorCode::invalid_argument, "there is no such log level",
              {.expected = join(kLogLevels), .found = name});
}

template <LogLevel Level>
void write(const PyLog& log, const py::str& format, const py::args& arguments) {
  if (log.is_on(Level)) log.write(Level, format, arguments);
}

}  // namespace

void PyLog::write(LogLevel level, const py::str& format, const py::args& arguments) const {
  const char* const kept = kept_format(format);
  const std::size_t count = kept == nullptr ? 1 : std::min(arguments.size(), LogLine::kMostArguments);
  const std::size_t texts = kept == nullptr ? 1 : texts_in(arguments, count);
  const std::size_t places = texts == 0 ? 0 : (LogLine::kMostArguments - (count - texts)) / texts;
  LogLine
      said;  // not in the ring's place: the text of an argument may be code of the user, which may log, or raise
  said.format = kept == nullptr ? "{}" : kept;
  if (kept == nullptr) {
    said.add_text(0, std::string(format), places);
  } else {
    for (std::size_t number = 0; number < count; ++number)
      add_argument(said, number, arguments[number], places);
  }
  Log(link_->log()).write_line(level, [&](LogLine& line) {
    line.place = {};
    line.format = said.format;
    line.used = said.used;
    line.arguments = said.arguments;
    line.values = said.values;
  });
}

void bind_log(py::module_& module) {
  constexpr const char* kWrite =
      "Write a line: `warn(\"tracking error {:.3f} m\", error)`, of up to 8 arguments.";
  py::class_<PyLog>(module, "Log",
                    R"(Lines for the console, /rosout and the bag, formatted later on another thread.

A place is `{}`, or `{:.3f}` with a precision; `{{` and `}}` are braces. Texts share 64 bytes; what does not fit is cut.)")
      .def("debug", &write<LogLevel::debug>, py::arg("format"), kWrite)
      .def("info", &write<LogLevel::info>, py::arg("format"), kWrite)
      .def("warn", &write<LogLevel::warn>, py::arg("format"), kWrite)
      .def("warning", &write<LogLevel::warn>, py::arg("format"), "As warn().")
      .def("error", &write<LogLevel::error>, py::arg("format"), kWrite)
      .def("fatal", &write<LogLevel::fatal>, py::arg("format"), kWrite)
      .def(
          "is_on",
          [](const PyLog& self, const std::string& level) { return self.is_on(require_level(level)); },
          py::arg("level"), "Whether a line of that level is kept.");
  py::class_<LogEntry>(module, "LogEntry", "A log line.")
      .def_readonly("time_ns", &LogEntry::time_ns, "When it was written, CLOCK_MONOTONIC or simulated.")
      .def_readonly("level", &LogEntry::level, "`debug`, `info`, `warn`, `error` or `fatal`.")
      .def_readonly("component", &LogEntry::component,
                    "Whose thread wrote it, or whose hook; '': neither was a component's.")
      .def_readonly(
          "source", &LogEntry::source,
          "The resource that wrote it; `shadow`: a shadow of the component; '': the component itself.")
      .def_readonly("state", &LogEntry::state, "What the component was in; '': it ran on no thread of one.")
      .def_readonly("text", &LogEntry::text)
      .def_readonly("format", &LogEntry::format, "The text without its arguments.")
      .def_readonly("function", &LogEntry::function, "Where it was written, in C++.")
      .def_readonly("file", &LogEntry::file)
      .def_readonly("line", &LogEntry::line);
  py::class_<LogEntries>(module, "LogEntries", "What one look at an architecture's log yields.")
      .def_readonly("lines", &LogEntries::lines, "In the order of their instants.")
      .def_readonly("lost", &LogEntries::lost,
                    "By component ('': by threads of none): lines that found no room since the look before.");
  module.attr("NO_LOG") = PyLog(std::make_shared<ShellLink>());
}

void add_log_methods(py::class_<PyArchitecture>& architecture) {
  architecture
      .def(
          "take_log", [](PyArchitecture& self) { return take_log(self.architecture); }, Unlocked(),
          "Take the log lines that its parts have written since the last call.")
      .def(
          "set_log_level",
          [](PyArchitecture& self, const std::string& name, const std::string& level) {
            self.architecture.set_log_level(name, require_level(level));
          },
          py::arg("name"), py::arg("level"), Unlocked(),
          "Keep lines of a component, or of a resource, from this level on. While it runs, too.")
      .def(
          "log_level",
          [](PyArchitecture& self, const std::string& name) {
            return std::string(to_string(self.architecture.log_level(name)));
          },
          py::arg("name"), Unlocked());
}

}  // namespace mauve::bindings

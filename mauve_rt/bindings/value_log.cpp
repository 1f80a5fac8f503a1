// SPDX-License-Identifier: LGPL-3.0-or-later
// The writes to a resource, for a recorder in Python.
#include "translate.hpp"

namespace mauve::bindings {

namespace {

/// Every write to the resource of a name, also when another one takes that name. For one thread.
class ValueLog {
 public:
  using Writes = std::vector<std::pair<std::vector<std::byte>, time_ns_t>>;

  /// Throws Error: there is no such resource, or it has no values.
  ValueLog(PyArchitecture& architecture, std::string resource, std::size_t bytes)
      : architecture_(architecture.architecture),
        name_(std::move(resource)),
        bytes_(bytes),
        followed_(architecture_.hold_resource(name_)) {
    begin();
  }
  ~ValueLog() { end(); }
  ValueLog(const ValueLog&) = delete;
  ValueLog& operator=(const ValueLog&) = delete;

  Writes take() {
    Writes writes;
    take_rest(writes);
    std::shared_ptr<Resource> present = architecture_.find_resource(name_);
    if (present != followed_ && !ended_) {
      take_rest(writes);
      leave();
      followed_ = std::move(present);
      follow();
    }
    return writes;
  }
  std::uint64_t lost() const {
    return lost_ + (resource_ == nullptr ? 0 : resource_->lost_writes() - lost_before_);
  }
  void end() noexcept {
    if (ended_) return;
    ended_ = true;
    leave();
  }

 private:
  void begin() {
    followed_->begin_log(bytes_);
    resource_ = followed_;
    lost_before_ = resource_->lost_writes();
  }
  /// A resource without values has taken the name: there is nothing to keep until another one does.
  void follow() {
    try {
      if (followed_ != nullptr) begin();
    } catch (const Error&) {
      resource_ = nullptr;
    }
  }
  void leave() {
    if (resource_ == nullptr) return;
    lost_ += resource_->lost_writes() - lost_before_;
    resource_->end_log();
    resource_ = nullptr;
  }
  void take_rest(Writes& writes) {
    if (resource_ == nullptr) return;
    std::vector<std::byte> message;
    time_ns_t time_ns = 0;
    while (resource_->next_write(message, time_ns)) writes.emplace_back(message, time_ns);
  }

  Architecture& architecture_;
  const std::string name_;
  const std::size_t bytes_;
  std::shared_ptr<Resource> followed_;  // of that name; nullptr: it was removed
  std::shared_ptr<Resource> resource_;  // the same while its writes are kept
  std::uint64_t lost_{0};
  std::uint64_t lost_before_{0};  // this log, by the present resource
  bool ended_{false};
};

Typed<"list[tuple[bytes, int]]"> take(ValueLog& self) {
  ValueLog::Writes writes;
  {
    const InterpreterUnlocked release;
    writes = self.take();
  }
  py::list all;
  for (const auto& [message, time_ns] : writes)
    all.append(
        py::make_tuple(py::bytes(reinterpret_cast<const char*>(message.data()), message.size()), time_ns));
  return all;
}

}  // namespace

void bind_value_log(py::module_& module) {
  using Unlocked = py::call_guard<InterpreterUnlocked>;
  py::class_<ValueLog>(
      module, "ValueLog",
      "Every write to the resource of a name, also when another one takes that name. For one thread.")
      .def(py::init<PyArchitecture&, std::string, std::size_t>(), py::arg("architecture"),
           py::arg("resource"), py::kw_only(), py::arg("bytes") = std::size_t{1} << 20U,
           py::keep_alive<1, 2>(), Unlocked(),
           R"(Keep writes from now on, as many as have room in about so many bytes: 16 to 8,192.

Raises:
    MauveError: there is no such resource, or it has no values.)")
      .def("take", &take,
           "(serialized message, writer's time in ns) of each write since the last call, in order.")
      .def("end", &ValueLog::end, Unlocked(),
           "Keep no more; what was not taken is gone. May be called again.")
      .def_property_readonly("lost", &ValueLog::lost, "Writes that found no room.");
}

}  // namespace mauve::bindings

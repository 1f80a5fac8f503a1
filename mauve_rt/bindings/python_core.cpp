// SPDX-License-Identifier: LGPL-3.0-or-later
// Cores written in Python. Their methods run on the component's own thread under the interpreter's lock.
#include "python_core.hpp"

#include <algorithm>
#include <cstring>

namespace mauve::bindings {

PythonCore::~PythonCore() {
  const InterpreterLocked lock;
  link_->shell = nullptr;
  link_->context = nullptr;
  methods_.clear();
}

bool PythonCore::bind_shell(Shell& shell) noexcept {
  link_->shell = &shell;
  return true;  // whether it is the one the core was written for, the object says when it is made
}

void PythonCore::set_context(const Context* context) noexcept {
  CoreBase::set_context(context);
  link_->context = context;
  if (auto* shell = dynamic_cast<PythonShell*>(link_->shell)) shell->show_clock(context);
}

int PythonCore::find_method(std::string_view name) const {
  return in_python([&] {
    make();
    const std::string attribute(name);
    if (!py::hasattr(object(), attribute.c_str())) return -1;
    methods_.push_back(object().attr(attribute.c_str()));
    return static_cast<int>(methods_.size()) - 1;
  });
}

void PythonCore::run(int method) {
  raise_from_take();
  on_component([&] { methods_[static_cast<std::size_t>(method)](); });
}

bool PythonCore::test(int method) {
  return on_component([&] { return methods_[static_cast<std::size_t>(method)]().cast<bool>(); });
}

bool PythonCore::adopt(const CoreBase& old) {
  return in_python([&] {
    if (!py::hasattr(object(), "adopt")) return true;
    const py::object answer = object().attr("adopt")(object_of(old));
    return answer.is_none() || answer.cast<bool>();
  });
}

// The swap is decided when take runs, so what it raises cannot refuse it: it is the first fault of the new
// core.
void PythonCore::take(CoreBase& old) noexcept {
  try {
    on_component([&] {
      if (py::hasattr(object(), "take")) object().attr("take")(object_of(old));
    });
  } catch (const std::exception& failure) {
    note_failure(failure);
  }
}

void PythonCore::note_failure(const std::exception& failure) noexcept {
  if (take_failure_ != nullptr) return;  // the first one is the cause
  take_failure_ = std::make_unique<std::string>(std::string("take failed: ") + failure.what());
}

std::vector<StateField> PythonCore::state_fields() {
  return in_python([this] {
    if (cells_) return fields_;
    make();
    cells_.set(py::module_::import("mauve_rt.parts.state_fields").attr("StateCells")(object()));
    constexpr std::size_t kAlignment = 8;
    std::size_t size = 0;
    for (const py::handle& field : cells_.get().attr("fields"))
      size += (field.cast<py::tuple>()[2].cast<std::size_t>() + kAlignment - 1) / kAlignment * kAlignment;
    block_.resize(size);
    std::byte* place = block_.data();
    for (const py::handle& each : cells_.get().attr("fields")) {
      const auto field = each.cast<py::tuple>();
      const auto bytes = field[2].cast<std::size_t>();
      fields_.push_back({field[0].cast<std::string>(), field[1].cast<std::string>(), place, bytes});
      place += (bytes + kAlignment - 1) / kAlignment * kAlignment;
    }
    return fields_;
  });
}

bool PythonCore::store_state() noexcept {
  try {
    return on_component([this] {
      const auto stored = cells_.get().attr("store")().cast<py::tuple>();
      const std::string_view block = stored[0].cast<std::string_view>();
      std::memcpy(block_.data(), block.data(), std::min(block.size(), block_.size()));
      return stored[1].cast<bool>();
    });
  } catch (const std::exception&) {
    return false;
  }
}

void PythonCore::load_state() noexcept {
  try {
    on_component([this] { cells_.get().attr("load")(to_bytes(block_)); });
  } catch (const std::exception& failure) {
    note_failure(failure);
  }
}

void PythonCore::raise_from_take() {
  if (take_failure_ == nullptr) return;
  const std::unique_ptr<std::string> failure = std::move(take_failure_);
  throw std::runtime_error(*failure);
}

time_ns_t PythonCore::budget_ns() const noexcept { return budget_ns_; }

bool PythonCore::configure_hook() {
  return in_python([&] {
    make();
    return call_hook(object(), "configure");
  });
}

void PythonCore::cleanup_hook() {
  in_python([&] { call_hook(object(), "cleanup"); });
}

void PythonCore::make() const {
  if (object_) return;
  object_.set(factory_->get()(ShellView(link_)));
  budget_ns_ = py::getattr(object(), "budget_ns", py::int_(budget_ns_)).cast<time_ns_t>();
}

py::object PythonCore::object_of(const CoreBase& core) {
  const auto* python = dynamic_cast<const PythonCore*>(&core);
  return python != nullptr && python->object_ ? python->object() : py::none();
}

CoreDescription describe_core(CoreBase& core, Shell& shell, const PluginRegistry& registry) {
  if (!core.bind_shell(shell)) {
    throw Error(ErrorCode::type_mismatch, "the core was written for another shell",
                {.element = core.description(), .found = shell.implementation()});
  }
  CoreDescription description{.name = core.implementation(),
                              .shell = shell.implementation(),
                              .is_python = dynamic_cast<const PythonCore*>(&core) != nullptr,
                              .classes = registry.classes_of("core", core.implementation()),
                              .wcet_ns = core.wcet_ns(),
                              .budget_ns = 0,
                              .state_fields = {}};
  for (const StateField& field : core.state_fields())
    description.state_fields.emplace_back(field.name, field.type);
  description.budget_ns =
      core.budget_ns();  // a core in Python knows it once its object is made: state_fields()
  return description;
}

std::unique_ptr<CoreBase> make_python_core(const PartFactory& factory) {
  auto core = std::make_unique<PythonCore>(factory.make);
  core->set_implementation(factory.name);
  core->set_wcet_ns(factory.wcet_ns);
  core->set_factory([factory] { return make_python_core(factory); });
  return core;
}

}  // namespace mauve::bindings

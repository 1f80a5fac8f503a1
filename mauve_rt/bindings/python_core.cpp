// SPDX-License-Identifier: LGPL-3.0-or-later
// Cores written in Python. Their methods run on the component's own thread under the interpreter's lock.
#include "python_core.hpp"

namespace mauve::bindings {

PythonCore::~PythonCore() {
  const py::gil_scoped_acquire lock;
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
    take_failure_ = std::make_unique<std::string>(std::string("take failed: ") + failure.what());
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

std::unique_ptr<CoreBase> make_python_core(const PartFactory& factory) {
  auto core = std::make_unique<PythonCore>(factory.make);
  core->set_implementation(factory.name);
  return core;
}

}  // namespace mauve::bindings

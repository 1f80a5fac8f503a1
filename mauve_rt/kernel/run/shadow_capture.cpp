// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/shadow_capture.hpp"

#include <algorithm>
#include <cstring>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"

namespace mauve {

/// The tap of one port. An event port has one that receives nothing, so that places stay those of the shell.
class ShadowCapture::Tap final : public PortTap {
 public:
  Tap(ShadowCapture& capture, PortBase& its_port, std::size_t place)
      : port(its_port), capture_(capture), place_(place) {}

  void on_read(const void* value, DataStatus status, time_ns_t time_ns) noexcept override {
    PortNote& note = capture_.present_.notes[place_];
    if (note.is_noted) return;
    note = {.time_ns = time_ns, .status = status, .is_noted = true};
    if (status != DataStatus::none) copy(value);
  }
  void on_write(const void* value) noexcept override {
    capture_.present_.notes[place_].is_noted = true;
    copy(value);
  }

  PortBase& port;
  std::size_t bytes{0};
  std::size_t offset{0};

 private:
  void copy(const void* value) noexcept {
    std::memcpy(capture_.present_.values.data() + offset, value, bytes);
  }

  ShadowCapture& capture_;
  std::size_t place_;
};

ShadowCapture::ShadowCapture(const Shell& shell, const std::string& component) {
  std::size_t all = 0;
  for (const auto& port : shell.ports()) {
    auto& tap = *ports_.emplace_back(std::make_unique<Tap>(*this, *port, ports_.size()));
    if (port->kind() == PortKind::event) continue;
    const auto refuse = [&](ErrorCode code, const char* what, const std::string& expected,
                            const std::string& found, const char* remedy) {
      throw Error(code, what,
                  {.component = component,
                   .element = "port " + port->name(),
                   .expected = expected,
                   .found = found,
                   .remedy = remedy});
    };
    if (port->kind() == PortKind::call) {
      refuse(ErrorCode::type_mismatch, "a component with a call port has no shadow: each call has effects",
             "read, write and event ports", "a call port", "try the core on probation instead");
    }
    const std::unique_ptr<PortCell> cell = port->make_cell();
    if (cell == nullptr) {
      refuse(ErrorCode::type_mismatch, "the port's values cannot be copied in real time",
             "a trivially copyable C++ type", port->type(),
             "give the port a struct without texts and lists of any length, or try the core on probation");
    }
    tap.bytes = cell->bytes();
    tap.offset = all;
    all +=
        (tap.bytes + alignof(std::max_align_t) - 1) / alignof(std::max_align_t) * alignof(std::max_align_t);
    if (tap.bytes > kMostPortBytes || all > kMostReleaseBytes) {
      refuse(ErrorCode::out_of_range, "the values are too large to be copied at each release",
             "at most " + std::to_string(kMostPortBytes) + " bytes, and " +
                 std::to_string(kMostReleaseBytes) + " of all ports together",
             std::to_string(tap.bytes) + " bytes, " + std::to_string(all) + " with the ports before",
             "make the messages smaller, or try the core on probation");
    }
  }
  const auto make_room = [&](Slot& slot) {
    slot.notes.resize(ports_.size());
    slot.values.resize(all);
  };
  make_room(present_);
  for (Slot& slot : slots_) make_room(slot);
}

void ShadowCapture::make_room_for_state(std::size_t bytes) {
  present_.state.resize(bytes);
  for (Slot& slot : slots_) slot.state.resize(bytes);
}

ShadowCapture::~ShadowCapture() { detach(); }

void ShadowCapture::attach(std::int64_t from) noexcept {
  from_ = from;
  is_attached_.store(true, std::memory_order_release);
  for (const auto& tap : ports_) tap->port.tap(*tap);
}

void ShadowCapture::detach() noexcept {
  if (!is_attached_.exchange(false, std::memory_order_acq_rel)) return;
  for (const auto& tap : ports_) tap->port.untap(*tap);
}

void ShadowCapture::start() noexcept {
  from_ = kStart;
  is_anew_ = true;
  forget_release();
}

void ShadowCapture::forget_release() noexcept {
  present_.has_state = false;
  for (PortNote& note : present_.notes) {
    note.is_noted = false;
    if (note.status == DataStatus::new_data) note.status = DataStatus::old_data;
  }
}

const std::byte* ShadowCapture::present(std::size_t port) const noexcept {
  return present_.values.data() + ports_[port]->offset;
}

bool ShadowCapture::end_release(time_ns_t instant_ns, std::int64_t next_from) noexcept {
  present_.release = {.number = number_++, .instant_ns = instant_ns, .from = from_, .is_anew = is_anew_};
  from_ = next_from;
  const std::uint64_t filled = filled_.load(std::memory_order_relaxed);  // relaxed: this thread writes it
  const std::uint64_t taken = filled - emptied_.load(std::memory_order_acquire);
  MAUVE_AUDIT(taken <= kSlots);
  const bool is_free = taken < kSlots;
  captured_.store(number_, std::memory_order_relaxed);
  if (is_free) {
    Slot& slot = slots_[filled % kSlots];
    slot.release = present_.release;
    std::copy(present_.notes.begin(), present_.notes.end(), slot.notes.begin());
    std::memcpy(slot.values.data(), present_.values.data(), present_.values.size());
    slot.has_state = present_.has_state;
    if (slot.has_state) std::memcpy(slot.state.data(), present_.state.data(), present_.state.size());
    filled_.store(filled + 1, std::memory_order_release);
    is_anew_ = false;
  } else {
    skipped_.store(skipped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  forget_release();
  return is_free;
}

const ShadowCapture::Release* ShadowCapture::front() const noexcept {
  const std::uint64_t emptied = emptied_.load(std::memory_order_relaxed);  // relaxed: this thread writes it
  if (emptied == filled_.load(std::memory_order_acquire)) return nullptr;
  return &slots_[emptied % kSlots].release;
}

void ShadowCapture::pop() noexcept {
  MAUVE_EXPECTS(front() != nullptr);
  // release: the slot was read before. The shadow's thread alone writes it.
  emptied_.store(emptied_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
}

const ShadowCapture::PortNote& ShadowCapture::note(std::size_t port) const noexcept {
  MAUVE_EXPECTS(port < ports_.size());
  return slots_[emptied_.load(std::memory_order_relaxed) % kSlots].notes[port];
}

const std::byte* ShadowCapture::state() const noexcept {
  const Slot& slot = slots_[emptied_.load(std::memory_order_relaxed) % kSlots];
  return slot.has_state ? slot.state.data() : nullptr;
}

const std::byte* ShadowCapture::value(std::size_t port) const noexcept {
  MAUVE_EXPECTS(port < ports_.size());
  return slots_[emptied_.load(std::memory_order_relaxed) % kSlots].values.data() + ports_[port]->offset;
}

}  // namespace mauve

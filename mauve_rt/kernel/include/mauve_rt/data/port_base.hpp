// SPDX-License-Identifier: LGPL-3.0-or-later
// What all ports are, whatever they carry: a name, a kind, a type, and one connection that can be exchanged.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mauve_rt/base/biased_mutex.hpp"
#include "mauve_rt/base/context.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/previews.hpp"
#include "mauve_rt/base/revocable_reference.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/data/frames.hpp"
#include "mauve_rt/data/number_place.hpp"
#include "mauve_rt/data/output_watch.hpp"
#include "mauve_rt/data/port_cell.hpp"
#include "mauve_rt/data/port_tap.hpp"
#include "mauve_rt/data/service.hpp"
#include "mauve_rt/data/slew_limit.hpp"

namespace mauve {

/// What the kernel does to an output while its component is not running.
enum class OutputPolicy : std::uint8_t {
  hold,      // leave the last value
  set_zero,  // write the type's default value
};

/// "hold" or "set_zero". [rt]
std::string_view to_string(OutputPolicy policy) MAUVE_RT;

struct OutputOptions {
  OutputPolicy on_commit{OutputPolicy::hold};
  OutputPolicy on_stop{OutputPolicy::set_zero};
};

/// All that a port needs to be connected, made beforehand; default: no connection.
struct PortConnection {
  ServiceBase* service{nullptr};
  std::string resource;
  std::uint32_t trace_id{0};          // of "resource.service", for calls
  std::shared_ptr<const void> use{};  // Resource::use()
};

/// Where a port leads to, by name; both empty: nowhere.
struct ConnectedTo {
  std::string resource;
  std::string service;
  time_ns_t longest_hold_ns{0};  // of the resource's lock; 0: not declared
};

/// A port seen without its type. Its connection changes only while the component is parked or held.
/// A port does not know when its service ends: disconnect it before the resource goes.
///
/// special_ says whether a read or a write may be anything but a look at the service: one load tells. Its bits: closed or left
/// behind, by the watchdog and who removes the component; watched and tapped, with watch_ and tap_; previewed, with stand_ins_;
/// limited, with slew_limit_; held, with hold_.
///
/// | member      | written by                     | read by                   | order                                |
/// | ----------- | ------------------------------ | ------------------------- | ------------------------------------ |
/// | connection_ | swap(), component parked       | component; connected_to() | parking publishes it; shown_mutex_   |
/// | context_    | [setup]                        | component                 | -                                    |
/// | optional_, frames_, slew_limit_ | [setup]    | any                       | -; the limit's own: slew_limit.hpp   |
/// | special_    | see below                      | component                 | acq_rel: its zeros stay last; who sees a bit sees what it stands for |
/// | is_safe_    | who writes its last output     | same                      | Task::outputs_: one at a time        |
/// | is_counted_ | swap(), who removes it         | same                      | one change at a time                 |
/// | is_seated_  | swap()                         | same                      | one change at a time                 |
/// | own_seat_   | the service that gave it       | same, the component       | its own: biased_mutex.hpp            |
/// | stand_ins_  | preview(), end_preview()       | the thread that previews  | each its own: base/previews.hpp; its bit: shown_mutex_ |
/// | watch_      | the component's thread; who ends the watch | component            | its own: revocable_reference.hpp     |
/// | tap_        | the component's thread; who ends the tap | component              | its own: revocable_reference.hpp     |
/// | hold_       | the component's thread; who ends the hold | component             | its own: revocable_reference.hpp     |
class PortBase {
 public:
  PortBase(std::string name, PortKind kind, std::string type)
      : name_(std::move(name)), kind_(kind), type_(std::move(type)) {}
  virtual ~PortBase() = default;
  PortBase(const PortBase&) = delete;
  PortBase& operator=(const PortBase&) = delete;

  /// [rt]
  const std::string& name() const MAUVE_RT { return name_; }
  PortKind kind() const MAUVE_RT { return kind_; }
  const std::string& type() const MAUVE_RT { return type_; }
  /// As ServiceBase::representation(). [rt]
  virtual std::string_view representation() const MAUVE_RT { return "C++"; }
  /// The messages it carries, as their C++ structs have them; none where no struct is known. [non-rt]
  virtual std::vector<MessageShape> messages() const { return {}; }
  /// Whether its component is configured only with it connected: call ports always, others unless optional. [rt]
  bool is_required() const MAUVE_RT { return kind_ == PortKind::call || !optional_; }
  /// Lets it go unconnected; a call port stays required. [setup]
  void make_optional() noexcept { optional_ = true; }
  /// The frames of its values; nullptr: none is declared. [rt]
  const Frames* frames() const MAUVE_RT { return frames_; }
  /// Of a port that reads or writes. [setup] Throws Error: invalid_argument (a name, another kind of port), frame_mismatch (it
  /// declares another frame already).
  void declare_frames(const Frames& frames);
  /// [rt]
  bool is_connected() const MAUVE_RT { return connection().service != nullptr; }
  /// Whether its service has given it a place of its own: ServiceBase::seat(). [rt]
  bool is_seated() const MAUVE_RT { return is_seated_; }
  /// The connected service, or nullptr; for the component itself and for who connects it. [rt]
  ServiceBase* service() const MAUVE_RT { return connection().service; }
  const std::string& resource_name() const MAUVE_RT { return connection().resource; }
  /// Where it leads to, also while that is being changed. [non-rt]
  ConnectedTo connected_to() const;

  /// Checks that a service fits, without regard to how many ports it has. [non-rt]
  /// Throws Error: type_mismatch (kind, type, or the C++ type behind an equal name), frame_mismatch.
  void check(const ServiceBase& service) const;
  /// Checks a service and makes the connection to it, to be swapped in. [non-rt] Throws as check().
  PortConnection prepare(ServiceBase& service, const std::string& resource_name) const;
  /// Exchanges the connection for one made by this port's prepare(), or for none. [rt]
  /// The component is parked or held. What was read is forgotten; the caller frees what it gets.
  void swap(PortConnection& connection) MAUVE_RT;

  /// check, prepare and swap. [non-rt] The component is parked.
  /// Throws Error: type_mismatch, frame_mismatch, invalid_argument (the service takes no more ports).
  void connect(ServiceBase& service, const std::string& resource_name);
  /// [non-rt] The component is parked.
  void disconnect() noexcept;
  /// [setup]
  void set_context(const Context* context) noexcept { context_ = context; }

  /// Until end_preview() the calling thread has a port of its own in place of this one, connected as told; all others
  /// have the present one. So the parts that a transaction puts in are configured with the wiring that it makes. What
  /// that thread writes or raises goes nowhere: until the commit nothing is changed. [non-rt]
  void preview(const PortConnection& connection);
  void end_preview() noexcept;

  /// Writes the type's default value, as of now or as of that time, with numbers as near to it as their max_slew lets them come;
  /// a port that is no write port does nothing. [rt]
  void write_zero() MAUVE_RT { write_zero(stamp_ns()); }
  virtual void write_zero(time_ns_t /*time_ns*/) MAUVE_RT {}
  /// Writes what `on_stop` says, as the output of a stop: it is sent before all others, and no max_slew holds it back. [rt]
  void write_stopped(time_ns_t time_ns) MAUVE_RT;
  /// The same to a service that fits the port, whether it is connected to it or not, without waiting for a lock. [rt]
  virtual TryWrite try_write_zero(ServiceBase& /*service*/, time_ns_t /*time_ns*/) MAUVE_RT {
    return TryWrite::done;
  }
  /// The same where the service cannot do without waiting. [rt]
  virtual void write_zero_to(ServiceBase& /*service*/, time_ns_t /*time_ns*/) MAUVE_RT {}
  virtual OutputOptions output() const MAUVE_RT { return {OutputPolicy::hold, OutputPolicy::hold}; }
  /// What `on_stop` lets a stop write, as a message; empty: nothing. [non-rt]
  std::vector<std::byte> stop_message() const {
    return output().on_stop == OutputPolicy::set_zero ? zero_message() : std::vector<std::byte>{};
  }
  /// After this the port swallows writes and finds nothing to read, until reopened. [rt]
  void close() MAUVE_RT { set_special(kClosed | kLeft, kClosed); }
  void reopen() MAUVE_RT {
    is_safe_ = false;
    set_special(kClosed | kLeft, 0);
  }
  /// Of a closed port: writes what `on_stop` says, once; waits for a lock only where the service cannot do without, and
  /// the caller allows it. [rt] Whether it is written.
  bool make_safe(bool may_wait, time_ns_t time_ns) MAUVE_RT;
  /// The same to a service that the port is to be connected to. [rt]
  bool make_safe(ServiceBase& service, bool may_wait, time_ns_t time_ns) MAUVE_RT;
  /// Its component is removed while a state of it still uses the port: gives up its place at the service, and swallows
  /// writes for good. The connection stays until disconnect(). [rt]
  void leave_behind() MAUVE_RT;

  /// Asks the watch before each write, until it is taken away or another one comes. [rt], on the component's thread, or parked.
  void watch(OutputWatch& watch) MAUVE_RT {
    watch_.set(watch);
    set_special(kWatched, kWatched);
  }
  /// No thread asks this watch any more afterwards. [rt] The thread that writes next takes the bit away: it sets it, too.
  void unwatch(const OutputWatch& watch) MAUVE_RT { watch_.revoke(watch, kForever); }
  /// Passes each value read or written to the tap, until untap(). [rt], on the component's thread, or parked.
  void tap(PortTap& tap) MAUVE_RT {
    tap_.set(tap);
    set_special(kTapped, kTapped);
  }
  /// No thread uses this tap any more afterwards. [rt] As unwatch().
  void untap(const PortTap& tap) MAUVE_RT { tap_.revoke(tap, kForever); }
  /// Passes each value to the hold in place of writing it, until unhold(); what write_zero() and write_stopped() write is not held.
  /// [rt], on the component's thread, or parked.
  void hold(PortTap& hold) MAUVE_RT {
    hold_.set(hold);
    set_special(kHeld, kHeld);
  }
  /// [rt] As unwatch().
  void unhold(const PortTap& hold) MAUVE_RT { hold_.revoke(hold, kForever); }
  /// Writes a value of its type as write() does, held or not. [rt], on the component's thread
  virtual void write_held(const void* /*value*/) MAUVE_RT {}
  /// Numbers of what it writes move no faster than this output says, from the last value that was written for the output.
  /// [setup] Throws Error (invalid_argument): no write port, no number there, values that cannot be copied in real time.
  void limit_slew(std::shared_ptr<SlewedOutput> output);
  /// Whether max_slew keeps the value of a stop from being reached in one step at that time. [rt], by who writes
  bool ramps_down_at(time_ns_t time_ns) MAUVE_RT;
  /// Whether a limit holds, and a stop writes its output. [rt]
  bool is_ramped() const MAUVE_RT {
    return slew_limit_ != nullptr && output().on_stop == OutputPolicy::set_zero;
  }
  /// The time before does not count: its component was stopped. [rt], by who writes
  void resume_slew(time_ns_t time_ns) MAUVE_RT {
    if (slew_limit_ != nullptr) slew_limit_->resume(time_ns);
  }
  /// A cell for this port's values, not connected; nullptr: they are not trivially copyable, or not C++. [non-rt]
  virtual std::unique_ptr<PortCell> make_cell() const { return nullptr; }
  /// Where the number at a path lies in a value that it writes; nothing: there is none at a fixed place. [non-rt]
  virtual std::optional<NumberPlace> find_number(std::string_view /*path*/) const { return {}; }

  /// A read as serialized message (for cores that are not C++); false when this is no read port. [non-rt]
  virtual bool read_serialized(std::vector<std::byte>& /*message*/, DataStatus& /*status*/,
                               time_ns_t& /*time*/) {
    return false;
  }
  /// A write of a serialized message; false when malformed or no write port. [non-rt]
  virtual bool write_serialized(std::span<const std::byte> /*message*/) { return false; }

 protected:
  /// Makes room for a copy of a value; returns the type's default value, or nullptr: a copy may allocate. [setup]
  virtual const void* make_room_to_limit() { return nullptr; }
  /// nullptr: no number is limited. [rt]
  SlewLimit* slew_limit() const MAUVE_RT { return slew_limit_.get(); }
  /// What write_zero() writes, as a message; empty: nothing. [non-rt]
  virtual std::vector<std::byte> zero_message() const { return {}; }
  /// Whether a service of equal kind and type name, and with messages that lie in memory as this port's, is of the class that
  /// this port needs. Of data the messages say all.
  virtual bool fits(const ServiceBase& /*service*/) const noexcept { return true; }
  /// Lets go of the old service and takes the new one, which fits, or none. `seat`: the place that it has given. [rt]
  virtual void attach(ServiceBase* service, BiasedMutex::Seat* seat) MAUVE_RT = 0;
  /// Another port of this type, for a preview; not connected.
  virtual std::unique_ptr<PortBase> make_stand_in() const = 0;
  bool is_previewed() const noexcept {
    if (!has(kPreviewed)) [[likely]]
      return false;
    return stand_ins_.find() != nullptr;
  }
  /// The port that the previewing thread has in place of this one.
  template <typename Port>
  Port& stand_in() const noexcept {
    return static_cast<Port&>(**stand_ins_.find());
  }
  std::uint32_t trace_id() const noexcept { return connection_.trace_id; }
  /// Component's logical clock, or the real one outside of any. [rt]
  time_ns_t stamp_ns() const MAUVE_RT {
    return context_ != nullptr ? context_->clock_ns.load(std::memory_order_relaxed) : monotonic_now_ns();
  }
  /// Whether the watch lets this value be written. [rt]
  bool admits(const void* value) MAUVE_RT {
    if (!is_still(watch_, kWatched)) return true;
    bool is_admitted = true;
    watch_.use([&](OutputWatch& watch) MAUVE_RT { is_admitted = watch.admits(value); });
    return is_admitted;
  }
  /// [rt], on the component's thread.
  bool is_tapped() MAUVE_RT { return is_still(tap_, kTapped); }
  /// Of a tapped port. [rt] Out of line: the ports without a tap are to cost what they cost without taps.
  [[gnu::noinline, gnu::cold]] void tell_read(const void* value, DataStatus status, time_ns_t time_ns)
      MAUVE_RT {
    tap_.use([&](PortTap& tap) MAUVE_RT { tap.on_read(value, status, time_ns); });
  }
  [[gnu::noinline, gnu::cold]] void tell_write(const void* value) MAUVE_RT {
    tap_.use([&](PortTap& tap) MAUVE_RT { tap.on_write(value); });
  }
  /// Whether the value is held, and not to be written. [rt], on the component's thread.
  bool is_held_back(const void* value) MAUVE_RT {
    if (!is_still(hold_, kHeld)) return false;
    hold_.use([&](PortTap& hold) MAUVE_RT { hold.on_write(value); });
    return true;
  }
  /// Whether any of the others here may say something. [rt]
  bool is_special() const MAUVE_RT { return special_.load(std::memory_order_acquire) != 0; }
  bool is_closed() const MAUVE_RT { return has(kClosed | kLeft); }
  /// Closed, and its zeros are to stay last: its component has not been removed. [rt]
  bool keeps_zero() const MAUVE_RT { return has(kClosed); }

 private:
  static constexpr std::uint32_t kClosed = 1, kLeft = 2, kWatched = 4, kTapped = 8, kPreviewed = 16,
                                 kLimited = 32, kHeld = 64;

  bool has(std::uint32_t bits) const noexcept {
    return (special_.load(std::memory_order_acquire) & bits) != 0;
  }
  void set_special(std::uint32_t bits, std::uint32_t values) MAUVE_RT {
    std::uint32_t before = special_.load(std::memory_order_relaxed);
    while (!special_.compare_exchange_weak(before, (before & ~bits) | values, std::memory_order_acq_rel)) {
    }
  }

  /// Whether there is a watch or a tap; takes its bit away where it has gone.
  template <typename T>
  bool is_still(const RevocableReference<T>& reference, std::uint32_t bit) MAUVE_RT {
    if (reference.is_set()) return true;
    if (has(bit)) set_special(bit, 0);
    return false;
  }

  /// Throws Error (type_mismatch): its struct is not the service's.
  void check_layout(const ServiceBase& service) const;
  /// Throws Error (frame_mismatch): its resource declares another frame.
  void check_frames(const ServiceBase& service) const;
  const PortConnection& connection() const noexcept {
    return is_previewed() ? stand_in<PortBase>().connection_ : connection_;
  }

  std::string name_;
  PortKind kind_;
  std::string type_;
  mutable PiMutex shown_mutex_;  // a commit may swap while an ordinary thread describes the architecture
  PortConnection connection_;
  const Context* context_{nullptr};
  bool optional_{false};
  const Frames* frames_{nullptr};
  Atomic<std::uint32_t> special_{0};
  bool is_safe_{false};
  bool is_counted_{true};  // among the ports of its service
  BiasedMutex::Seat own_seat_;
  bool is_seated_{false};  // has its seat at connection_.service
  RevocableReference<OutputWatch> watch_;
  RevocableReference<PortTap> tap_;
  RevocableReference<PortTap> hold_;
  std::unique_ptr<SlewLimit> slew_limit_;
  Previews<std::unique_ptr<PortBase>> stand_ins_;
};

}  // namespace mauve

// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/port.hpp"

#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/data/call_type.hpp"
#include "mauve_rt/data/layout.hpp"
#include "mauve_rt/data/resource.hpp"

namespace mauve {

namespace {

/// While a stop writes to the resource of a service, if it has one. [rt]
class StopWrite {
 public:
  StopWrite(const ServiceBase* service, time_ns_t time_ns) noexcept
      : resource_(service != nullptr ? service->resource() : nullptr) {
    if (resource_ != nullptr) resource_->begin_stop(time_ns);
  }
  ~StopWrite() {
    if (resource_ != nullptr) resource_->end_stop();
  }
  StopWrite(const StopWrite&) = delete;
  StopWrite& operator=(const StopWrite&) = delete;

 private:
  Resource* resource_;
};

}  // namespace

std::string_view to_string(OutputPolicy policy) noexcept {
  return policy == OutputPolicy::hold ? "hold" : "set_zero";
}

std::string_view to_string(PortKind kind) noexcept {
  switch (kind) {
    case PortKind::read:
      return "read";
    case PortKind::write:
      return "write";
    case PortKind::call:
      return "call";
    case PortKind::event:
      return "event";
  }
  return "unknown";
}

time_ns_t ServiceBase::longest_hold_ns() const noexcept {
  return resource_ == nullptr ? 0 : resource_->longest_hold_ns();
}

CallOutcome ServiceBase::call_serialized(std::span<const std::byte> /*request*/,
                                         std::vector<std::byte>& /*reply*/) {
  return CallOutcome::malformed;
}

void ServiceBase::check_ports(std::uint32_t wanted) const {
  const std::uint32_t most = max_ports();
  if (most == 0 || wanted <= most) return;
  const std::string place = (resource_ == nullptr ? "" : resource_->name() + ".") + name_;
  throw Error(ErrorCode::invalid_argument, "the service takes no more ports",
              {.element = "service " + place,
               .expected = "at most " + std::to_string(most) + " port" + (most == 1 ? "" : "s"),
               .found = std::to_string(wanted),
               .remedy = kind_ == PortKind::write ? "disconnect the other writer, or use shared_data"
                                                  : "raise max_readers, or use shared_data"});
}

void PortBase::check(const ServiceBase& service) const {
  const auto shown = [](PortKind kind, const std::string& type) {
    return std::string(to_string(kind)) + (type.empty() ? "" : " of " + type);
  };
  const Resource* resource = service.resource();
  const std::string place = (resource == nullptr ? "" : resource->name() + ".") + service.name();
  if (service.kind() != kind_ || service.type() != type_) {
    throw Error(ErrorCode::type_mismatch, "the port does not fit the service",
                {.element = "port " + name_,
                 .expected = shown(kind_, type_),
                 .found = shown(service.kind(), service.type()) + " at " + place,
                 .remedy = "connect it to a service of equal kind and type"});
  }
  if (service.representation() != representation()) {
    throw Error(
        ErrorCode::type_mismatch, "port and service hold the type in different ways",
        {.element = "port " + name_,
         .expected = "a service in " + std::string(representation()),
         .found = "one in " + std::string(service.representation()) + " at " + place,
         .remedy = "relay through a shared_data whose type a plug-in library registers; load that library "
                   "before Python makes ports and resources of the type"});
  }
  check_layout(service);
  check_frames(service);
  if (!fits(service)) {
    throw Error(ErrorCode::type_mismatch, "port and service mean different C++ types by one name",
                {.element = "port " + name_,
                 .expected = shown(kind_, type_) + " as the port's library declares it",
                 .found = "another C++ type of that name at " + place,
                 .remedy = "let both packages use one declaration of the type, from one header"});
  }
}

void PortBase::declare_frames(const Frames& frames) {
  const std::string element = "port " + name_;
  if (kind_ != PortKind::read && kind_ != PortKind::write) {
    throw Error(ErrorCode::invalid_argument, "the values of the port are in no frame",
                {.element = element,
                 .expected = "a port that reads or writes",
                 .found = "a port of kind " + std::string(to_string(kind_)),
                 .remedy = "declare no frame for the port"});
  }
  check_frame_names(frames, element);
  const Frames before = frames_ == nullptr ? Frames{} : *frames_;
  if (const auto difference = frame_difference(before, frames)) {
    throw Error(ErrorCode::frame_mismatch, "the port declares another frame",
                {.element = element,
                 .expected = difference->ours + ", as its shell declares",
                 .found = difference->theirs,
                 .remedy = "remove one of the two declarations, or make them equal"});
  }
  frames_ = keep_frames(merged_frames(before, frames));
}

void PortBase::check_frames(const ServiceBase& service) const {
  const Resource* const resource = service.resource();
  if (frames_ == nullptr || resource == nullptr) return;
  const auto difference = frame_difference(*frames_, resource->frame_guard().declared());
  if (!difference) return;
  throw Error(ErrorCode::frame_mismatch, "the port and the resource are in different frames",
              {.element = "port " + name_,
               .expected = difference->ours + ", as the port declares",
               .found = difference->theirs + " of " + resource->name() + "." + service.name(),
               .remedy = std::string(kFrameRemedy)});
}

void PortBase::check_layout(const ServiceBase& service) const {
  if (kind_ != PortKind::read && kind_ != PortKind::write) return;
  const std::vector<MessageShape> ours = messages();
  const std::vector<MessageShape> theirs = service.messages();
  if (ours.empty() || theirs.empty()) return;  // not in C++: as the representation says
  const auto difference = layout_difference(ours.front(), theirs.front());
  if (!difference) return;
  const std::string field = difference->field.empty() ? "" : " in field '" + difference->field + "'";
  const auto of = [](const void* object) {
    const std::string library = library_of(object);
    return library.empty() ? "" : " (" + library + ")";
  };
  const Resource* resource = service.resource();
  throw Error(ErrorCode::type_mismatch, "port and service hold the type in different structs" + field,
              {.element = "port " + name_,
               .expected = difference->expected + of(this),
               .found = difference->found + " at " + (resource == nullptr ? "" : resource->name() + ".") +
                        service.name() + of(&service),
               .remedy = "build both packages against the same version of " + type_});
}

PortConnection PortBase::prepare(ServiceBase& service, const std::string& resource_name) const {
  check(service);
  PortConnection connection{.service = &service, .resource = resource_name};
  if (service.resource() != nullptr) connection.use = service.resource()->use();
  if (kind_ == PortKind::call) connection.trace_id = TraceNames::intern(resource_name + "." + service.name());
  return connection;
}

void PortBase::swap(PortConnection& connection) noexcept {
  MAUVE_EXPECTS(!is_seated_ || connection_.service != nullptr);
  attach(nullptr, nullptr);
  if (is_seated_) connection_.service->unseat(own_seat_);
  is_seated_ = connection.service != nullptr && connection.service->seat(own_seat_);
  attach(connection.service, is_seated_ ? &own_seat_ : nullptr);
  if (connection_.service != nullptr && is_counted_) connection_.service->remove_port();
  is_counted_ = true;
  if (connection.service != nullptr) connection.service->add_port();
  const LockGuard lock(shown_mutex_);
  MAUVE_RT_TRUSTED(std::swap(connection_, connection));  // moves: nothing is allocated, nothing freed
}

void PortBase::write_stopped(time_ns_t time_ns) noexcept {
  if (output().on_stop != OutputPolicy::set_zero) return;
  const StopWrite as_stop(connection_.service, time_ns);
  if (slew_limit_ == nullptr) return write_zero(time_ns);
  if (connection_.service == nullptr) return;
  slew_limit_->note_stop(time_ns);
  write_zero_to(*connection_.service, time_ns);
}

bool PortBase::make_safe(bool may_wait, time_ns_t time_ns) noexcept {
  MAUVE_AUDIT(is_closed());
  if (is_safe_) return true;
  ServiceBase* service = nullptr;
  {
    const LockGuard lock(shown_mutex_);  // a take that does not end may have come through here just now
    service = connection_.service;
  }
  if (service == nullptr) return true;
  return is_safe_ = make_safe(*service, may_wait, time_ns);
}

bool PortBase::make_safe(ServiceBase& service, bool may_wait, time_ns_t time_ns) noexcept {
  if (output().on_stop != OutputPolicy::set_zero) return true;
  if (slew_limit_ != nullptr) slew_limit_->note_stop(time_ns);
  const StopWrite as_stop(&service, time_ns);
  const TryWrite tried = try_write_zero(service, time_ns);
  if (tried != TryWrite::must_wait || !may_wait) return tried == TryWrite::done;
  write_zero_to(service, time_ns);
  return true;
}

void PortBase::limit_slew(std::shared_ptr<SlewedOutput> output) {
  const auto refuse = [this](const char* what, const std::string& path, const std::string& expected,
                             const std::string& found, const char* remedy) {
    throw Error(ErrorCode::invalid_argument, what,
                {.element = "max_slew " + name_ + (path.empty() ? "" : "." + path),
                 .expected = expected,
                 .found = found,
                 .remedy = remedy});
  };
  if (kind_ != PortKind::write) {
    refuse("max_slew is of numbers that the component writes", {}, "a write port",
           "a port of kind " + std::string(to_string(kind_)), "name one of the component's write ports");
  }
  const void* const zero = make_room_to_limit();
  if (zero == nullptr) {
    refuse("the port's values cannot be copied in real time", {}, "a trivially copyable C++ type",
           type_ + " in " + std::string(representation()),
           "let a plug-in library register a C++ struct of the type, without texts and lists of any length");
  }
  std::vector<NumberPlace> places;
  for (const SlewedNumber& number : output->numbers()) {
    const std::optional<NumberPlace> place = find_number(number.path);
    if (!place || place->store == nullptr) {
      refuse("the output has no such number", number.path,
             "a field of " + type_ + " that is a number, not in a text or a list whose length changes",
             number.path, "name the field of a number, such as twist.linear.x or torque[0]");
    }
    places.push_back(place.value_or(NumberPlace{}));
  }
  slew_limit_ = std::make_unique<SlewLimit>(std::move(output), std::move(places), zero);
  set_special(kLimited, kLimited);
}

bool PortBase::ramps_down_at(time_ns_t time_ns) noexcept {
  return is_ramped() && connection_.service != nullptr && slew_limit_->is_beyond(time_ns);
}

void PortBase::leave_behind() noexcept {
  set_special(kClosed | kLeft, kLeft);
  if (connection_.service != nullptr && is_counted_) connection_.service->remove_port();
  is_counted_ = false;
}

void PortBase::connect(ServiceBase& service, const std::string& resource_name) {
  PortConnection connection = prepare(service, resource_name);
  if (&service != connection_.service) {
    service.check_ports(service.ports() + 1);
    service.make_room(service.ports() + 1);
  }
  swap(connection);
}

void PortBase::disconnect() noexcept {
  PortConnection none;
  swap(none);
}

void PortBase::preview(const PortConnection& connection) {
  auto stand_in = make_stand_in();
  stand_in->set_context(context_);
  stand_in->attach(connection.service, nullptr);
  stand_in->connection_ = connection;
  end_preview();
  stand_ins_.begin() = std::move(stand_in);
  const LockGuard lock(shown_mutex_);  // another thread's preview may end: the bit stays while there is one
  set_special(kPreviewed, kPreviewed);
}

void PortBase::end_preview() noexcept {
  std::unique_ptr<PortBase>* const own = stand_ins_.find();
  if (own == nullptr) return;
  if (*own != nullptr) (*own)->attach(nullptr, nullptr);
  own->reset();
  const LockGuard lock(shown_mutex_);
  stand_ins_.end();
  if (!stand_ins_.is_any()) set_special(kPreviewed, 0);
}

ConnectedTo PortBase::connected_to() const {
  constexpr std::size_t kUsualLength = 64;  // nothing is allocated under the lock then
  ConnectedTo shown;
  shown.resource.reserve(kUsualLength);
  shown.service.reserve(kUsualLength);
  const LockGuard lock(shown_mutex_);
  if (connection_.service == nullptr) return shown;
  shown.resource = connection_.resource;
  shown.service = connection_.service->name();
  shown.longest_hold_ns = connection_.service->longest_hold_ns();
  return shown;
}

}  // namespace mauve

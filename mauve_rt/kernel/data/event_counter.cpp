// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/event_counter.hpp"

#include "mauve_rt/base/trace.hpp"

namespace mauve {

const char* type_of(EventMessage said) noexcept {
  switch (said) {
    case EventMessage::empty:
      return "std_msgs/msg/Empty";
    case EventMessage::truth:
      return "std_msgs/msg/Bool";
    default:
      return "std_msgs/msg/UInt64";
  }
}

namespace {

/// Empty has a byte too, as no message may be without a member.
void put_signal(std::vector<std::byte>& message, EventMessage said) {
  CdrWriter(message).put(std::uint8_t{said == EventMessage::truth});
}

}  // namespace

EventCounter::EventCounter(EventMessage said) : LoggedResource("event", type_of(said)), said_(said) {
  offer(read);
  offer(raise);
}

void EventCounter::set_name(const std::string& name) {
  Resource::set_name(name);
  mutex_.set_trace_id(TraceNames::intern(name));
}

DataStatus EventCounter::Read::read(EventCount& value, time_ns_t& time_ns, ReaderState& reader) noexcept {
  const LockGuard lock(owner_.mutex_);
  if (owner_.count_.data == 0) return DataStatus::none;
  value = owner_.count_;
  time_ns = owner_.time_ns_;
  return reader.look(value.data);
}

void EventCounter::Raise::raise(time_ns_t time_ns) noexcept {
  {
    const LockGuard lock(owner_.mutex_);
    ++owner_.count_.data;
    owner_.time_ns_ = time_ns;
    owner_.log(owner_.count_, time_ns);
  }
  owner_.written(time_ns);
}

bool EventCounter::next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) {
  EventCount count;
  ReaderState reader{.seen = seen};
  if (read.read(count, time_ns, reader) != DataStatus::new_data) return false;
  if (said_ == EventMessage::count) {
    seen = count.data;
    CdrWriter(message).put(count);
  } else {
    ++seen;
    put_signal(message, said_);
  }
  return true;
}

bool EventCounter::peek_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& sequence) {
  EventCount count;
  ReaderState reader;
  const DataStatus status = read.read(count, time_ns, reader);
  sequence = reader.seen;
  if (said_ == EventMessage::count)
    CdrWriter(message).put(count);
  else
    put_signal(message, said_);
  return status != DataStatus::none;
}

bool EventCounter::write_sample(std::span<const std::byte> message, time_ns_t time_ns) {
  CdrReader reader(message);
  EventCount ignored;
  std::uint8_t truth{};
  switch (said_) {
    case EventMessage::count:
      if (!reader.get(ignored)) return false;
      break;
    case EventMessage::truth:
      if (!reader.get(truth)) return false;
      if (truth == 0) return true;
      break;
    case EventMessage::empty:  // with its byte or without
      if (message.size() < kCdrHeader.size()) return false;
      break;
  }
  raise.raise(time_ns);
  return true;
}

ResourceKind EventKind::describe() {
  return {
      .name = "event",
      .messages = {type_of(EventMessage::empty), type_of(EventMessage::truth), type_of(EventMessage::count)}};
}

std::unique_ptr<Resource> EventKind::make(const std::string& message, const ResourceParameters&) {
  for (const EventMessage said : {EventMessage::empty, EventMessage::truth}) {
    if (message == type_of(said)) return std::make_unique<EventCounter>(said);
  }
  return std::make_unique<EventCounter>();
}

}  // namespace mauve

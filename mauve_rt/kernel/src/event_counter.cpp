// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/event_counter.hpp"

#include "mauve_rt/trace.hpp"

namespace mauve {

EventCounter::EventCounter() : Resource("event", type_name<EventCount>()) {
  offer(read);
  offer(raise);
}

void EventCounter::set_name(const std::string& name) {
  Resource::set_name(name);
  mutex_.set_trace_id(TraceNames::intern(name));
}

DataStatus EventCounter::Read::read(EventCount& value, time_ns_t& time_ns, ReaderState& reader) noexcept {
  const std::lock_guard lock(owner_.mutex_);
  if (owner_.count_.data == 0) return DataStatus::none;
  value = owner_.count_;
  time_ns = owner_.time_ns_;
  return reader.look(value.data);
}

void EventCounter::Raise::raise(time_ns_t time_ns) noexcept {
  {
    const std::lock_guard lock(owner_.mutex_);
    ++owner_.count_.data;
    owner_.time_ns_ = time_ns;
  }
  owner_.written(time_ns);
}

bool EventCounter::next_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& seen) {
  EventCount count;
  ReaderState reader{.seen = seen};
  if (read.read(count, time_ns, reader) != DataStatus::new_data) return false;
  seen = reader.seen;
  CdrWriter(message).put(count);
  return true;
}

bool EventCounter::peek_sample(std::vector<std::byte>& message, time_ns_t& time_ns, std::uint64_t& sequence) {
  EventCount count;
  ReaderState reader;
  const DataStatus status = read.read(count, time_ns, reader);
  sequence = reader.seen;
  CdrWriter(message).put(count);
  return status != DataStatus::none;
}

bool EventCounter::write_sample(std::span<const std::byte> message, time_ns_t time_ns) {
  EventCount ignored;
  if (!CdrReader(message).get(ignored)) return false;
  raise.raise(time_ns);
  return true;
}

}  // namespace mauve

// SPDX-License-Identifier: LGPL-3.0-or-later
// Data of ROS messages that no C++ library registered: serialized, between components in Python and topics.
#pragma once

#include <mutex>

#include "mauve_rt/mauve_rt.hpp"

namespace mauve::bindings {

inline constexpr std::string_view kSerializedRepresentation = "serialized";

using Message = std::vector<std::byte>;

class SerializedReadService : public ServiceBase {
 public:
  explicit SerializedReadService(std::string type, std::string name = "read")
      : ServiceBase(std::move(name), PortKind::read, std::move(type)) {}
  std::string_view representation() const noexcept override { return kSerializedRepresentation; }
  /// Copies what is there, else the type's zero. [non-rt]
  virtual DataStatus read(Message& message, time_ns_t& time_ns, std::uint64_t& seen) = 0;
};

class SerializedWriteService : public ServiceBase {
 public:
  explicit SerializedWriteService(std::string type, std::string name = "write")
      : ServiceBase(std::move(name), PortKind::write, std::move(type)) {}
  std::string_view representation() const noexcept override { return kSerializedRepresentation; }
  /// Takes a copy; false when there was no room, or more bytes than declared. [rt]
  virtual bool write(std::span<const std::byte> message, time_ns_t time_ns) MAUVE_RT = 0;
  /// The same without waiting for a lock. [rt]
  virtual TryWrite try_write(std::span<const std::byte> message, time_ns_t time_ns) MAUVE_RT = 0;
};

/// What a resource of serialized messages holds.
struct SerializedOptions {
  std::string type;
  std::vector<Message>
      zeros;  // the message with every field at its default; of an action its goal, result and feedback
  ResourceParameters parameters;  // all of the kind, checked
  int frame_ids{0};               // that its messages begin with: header.frame_id, and then child_frame_id
};

/// As ReadPort<T> and WritePort<T>.
std::unique_ptr<PortBase> make_serialized_port(PortKind kind, const std::string& name,
                                               const std::string& type, OutputOptions output,
                                               std::span<const std::byte> zero);
/// Of how many messages a type of that need consists: 3 of an action.
constexpr std::size_t messages_of(TypeNeed need) { return need == TypeNeed::action ? 3 : 1; }
/// Of the kinds action_server and action_client.
std::unique_ptr<Resource> make_serialized_server(const SerializedOptions& options);
std::unique_ptr<Resource> make_serialized_client(const SerializedOptions& options);
/// As PluginRegistry::make_resource, of a kind that has max_bytes. Throws Error: invalid_argument, unknown_type.
std::unique_ptr<Resource> make_serialized_resource(const std::string& kind, const SerializedOptions& options);

}  // namespace mauve::bindings

// SPDX-License-Identifier: LGPL-3.0-or-later
// Servers and clients of actions whose type no C++ library registered: goals, results and feedback are serialized messages.
#include "serialized.hpp"

namespace mauve::bindings {

namespace {

/// The parts of an action as messages, each in memory of `max_bytes` that is set aside before the start.
class ActionMessages {
 public:
  explicit ActionMessages(const SerializedOptions& options)
      : max_bytes_(static_cast<std::size_t>(get<std::int64_t>(options.parameters, "max_bytes"))),
        type_(options.type),
        zero_result_(options.zeros.at(1)) {}

  std::string goal_type() const { return type_ + "_Goal"; }
  std::string result_type() const { return type_ + "_Result"; }
  std::string feedback_type() const { return type_ + "_Feedback"; }
  const Message& zero_result() const noexcept { return zero_result_; }
  std::size_t max_bytes() const noexcept { return max_bytes_; }
  /// Whether it is a message, of at most max_bytes.
  bool fits(std::span<const std::byte> message) const MAUVE_RT {
    return message.size() >= kCdrHeader.size() && message.size() <= max_bytes_;
  }
  Message room() const {
    Message made;
    made.reserve(max_bytes_);
    return made;
  }
  std::vector<Message> rooms(std::size_t count) const {
    std::vector<Message> made(count);
    for (Message& each : made) each.reserve(max_bytes_);
    return made;
  }

 private:
  std::size_t max_bytes_;
  std::string type_;
  Message zero_result_;
};

/// Within what was reserved: allocates nothing.
void copy_message(std::span<const std::byte> from, Message& to) MAUVE_RT {
  MAUVE_RT_TRUSTED(to.assign(from.begin(), from.end()));
}

template <typename Owner, DataStatus (Owner::*Find)(Message&, time_ns_t&, ReaderState&) MAUVE_RT>
class ActionRead final : public SerializedReadService {
 public:
  ActionRead(Owner& owner, const char* name, std::string type, std::uint32_t max_ports)
      : SerializedReadService(std::move(type), name), owner_(owner), max_ports_(max_ports) {}
  std::uint32_t max_ports() const noexcept override { return max_ports_; }
  DataStatus read(Message& message, time_ns_t& time_ns, std::uint64_t& seen) override {
    message.reserve(owner_.messages().max_bytes());  // not under the lock
    ReaderState reader{.seen = seen};
    const DataStatus found = (owner_.*Find)(message, time_ns, reader);
    seen = reader.seen;
    return found;
  }

 private:
  Owner& owner_;
  const std::uint32_t max_ports_;
};

template <typename Owner, bool (Owner::*Put)(std::span<const std::byte>, time_ns_t) MAUVE_RT>
class ActionWrite final : public SerializedWriteService {
 public:
  ActionWrite(Owner& owner, const char* name, std::string type)
      : SerializedWriteService(std::move(type), name), owner_(owner) {}
  std::uint32_t max_ports() const noexcept override { return 1; }
  bool write(std::span<const std::byte> message, time_ns_t time_ns) noexcept override {
    return owner_.messages().fits(message) && (owner_.*Put)(message, time_ns);
  }
  /// Of a stop: `decide` alone acts then.
  TryWrite try_write(std::span<const std::byte> /*message*/, time_ns_t /*time_ns*/) noexcept override {
    return TryWrite::done;
  }
  void raise_floor(time_ns_t instant_ns) noexcept override { owner_.write_floor().raise(instant_ns); }
  void forget_floor() noexcept override { owner_.write_floor().forget(); }

 private:
  Owner& owner_;
};

/// As ActionServer<A>.
class SerializedServer final : public ActionServerBase {
 public:
  explicit SerializedServer(const SerializedOptions& options)
      : ActionServerBase(options.type, get<std::int64_t>(options.parameters, "goals"),
                         get<std::int64_t>(options.parameters, "answer_ns")),
        messages_(options),
        goals_(messages_.rooms(slots())),
        results_(messages_.rooms(slots())) {
    begin_result();
    offer_all(goal_service_, asked_service_, feedback_service_, result_service_);
  }

  const ActionMessages& messages() const noexcept { return messages_; }
  WriteFloor& write_floor() MAUVE_RT { return floor(); }

 protected:
  bool take_in(std::span<const std::byte> message) override {
    if (!messages_.fits(message)) return false;
    copy_message(message, taken_in_);
    return true;
  }
  void keep_goal(std::size_t slot) noexcept override {
    copy_message(taken_in_, goals_[slot]);
    copy_message(messages_.zero_result(), results_[slot]);
  }
  void keep_result(std::size_t slot) noexcept override {
    std::swap(result_, results_[slot]);
    begin_result();
  }
  void copy_feedback() noexcept override { copy_message(feedback_, feedback_out_); }
  void copy_result(std::size_t slot) noexcept override { copy_message(results_[slot], result_out_); }
  void put_feedback(std::vector<std::byte>& message) const override { message = feedback_out_; }
  void put_result(std::vector<std::byte>& message) const override { message = result_out_; }

 private:
  void begin_result() MAUVE_RT { copy_message(messages_.zero_result(), result_); }
  DataStatus find_goal(Message& message, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT {
    return read_goal([&](std::size_t slot) noexcept { copy_message(goals_[slot], message); }, time_ns,
                     reader);
  }
  DataStatus find_asked(Message& message, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT {
    return read_asked([&](std::size_t slot) noexcept { copy_message(goals_[slot], message); }, time_ns,
                      reader);
  }
  bool take_feedback(std::span<const std::byte> message, time_ns_t time_ns) MAUVE_RT {
    return give_feedback([&]() noexcept { copy_message(message, feedback_); }, time_ns);
  }
  bool take_result(std::span<const std::byte> message, time_ns_t time_ns) MAUVE_RT {
    return give_result([&]() noexcept { copy_message(message, result_); }, time_ns);
  }

  const ActionMessages messages_;
  // Under the base's mutex:
  std::vector<Message> goals_;        // by slot
  std::vector<Message> results_;      // of goals that have ended
  Message result_{messages_.room()};  // of the current one
  Message feedback_{messages_.room()};
  // Of the thread that takes in, and of the one that hands out:
  Message taken_in_{messages_.room()};
  Message result_out_{messages_.room()};
  Message feedback_out_{messages_.room()};
  ActionRead<SerializedServer, &SerializedServer::find_goal> goal_service_{*this, "goal",
                                                                           messages_.goal_type(), 1};
  ActionRead<SerializedServer, &SerializedServer::find_asked> asked_service_{*this, "asked",
                                                                             messages_.goal_type(), 1};
  ActionWrite<SerializedServer, &SerializedServer::take_feedback> feedback_service_{
      *this, "feedback", messages_.feedback_type()};
  ActionWrite<SerializedServer, &SerializedServer::take_result> result_service_{*this, "result",
                                                                                messages_.result_type()};
};

/// As ActionClient<A>.
class SerializedClient final : public ActionClientBase {
 public:
  explicit SerializedClient(const SerializedOptions& options)
      : ActionClientBase(options.type, get<std::int64_t>(options.parameters, "answer_ns")),
        messages_(options) {
    offer_all(goal_service_, feedback_service_, result_service_);
  }

  const ActionMessages& messages() const noexcept { return messages_; }
  WriteFloor& write_floor() MAUVE_RT { return floor(); }

 protected:
  void copy_goal() noexcept override { copy_message(goal_, goal_out_); }
  void put_goal(std::vector<std::byte>& message) const override { message = goal_out_; }
  bool take_in_feedback(std::span<const std::byte> message) override {
    return take_in(message, feedback_in_);
  }
  bool take_in_result(std::span<const std::byte> message) override { return take_in(message, result_in_); }
  void keep_feedback() noexcept override { copy_message(feedback_in_, feedback_); }
  void keep_result() noexcept override { copy_message(result_in_, result_); }

 private:
  bool take_in(std::span<const std::byte> message, Message& place) const noexcept {
    if (!messages_.fits(message)) return false;
    copy_message(message, place);
    return true;
  }
  bool take_goal(std::span<const std::byte> message, time_ns_t time_ns) MAUVE_RT {
    return begin_goal([&]() noexcept { copy_message(message, goal_); }, time_ns);
  }
  DataStatus find_feedback(Message& message, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT {
    return read_feedback([&]() noexcept { copy_message(feedback_, message); }, time_ns, reader);
  }
  DataStatus find_result(Message& message, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT {
    return read_result([&]() noexcept { copy_message(result_, message); }, time_ns, reader);
  }

  static constexpr std::uint32_t kAnyPorts = 0;

  const ActionMessages messages_;
  // Under the base's mutex:
  Message goal_{messages_.room()};
  Message feedback_{messages_.room()};
  Message result_{messages_.room()};
  // Of the thread that hands out, and of the one that takes in:
  Message goal_out_{messages_.room()};
  Message feedback_in_{messages_.room()};
  Message result_in_{messages_.room()};
  ActionWrite<SerializedClient, &SerializedClient::take_goal> goal_service_{*this, "goal",
                                                                            messages_.goal_type()};
  ActionRead<SerializedClient, &SerializedClient::find_feedback> feedback_service_{
      *this, "feedback", messages_.feedback_type(), kAnyPorts};
  ActionRead<SerializedClient, &SerializedClient::find_result> result_service_{
      *this, "result", messages_.result_type(), kAnyPorts};
};

}  // namespace

std::unique_ptr<Resource> make_serialized_server(const SerializedOptions& options) {
  return std::make_unique<SerializedServer>(options);
}
std::unique_ptr<Resource> make_serialized_client(const SerializedOptions& options) {
  return std::make_unique<SerializedClient>(options);
}

}  // namespace mauve::bindings

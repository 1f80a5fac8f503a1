// SPDX-License-Identifier: LGPL-3.0-or-later
// Calls that somebody outside of the architecture answers: none blocks longer than declared, a stop ends one.
#include "simulated.hpp"
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_client {

struct Increment {
  struct Request {
    std::uint32_t data{};
  };
  struct Response {
    std::uint32_t data{};
  };
};

}  // namespace mauve::testing::test_client

MAUVE_TYPE(mauve::testing::test_client::Increment::Request, "test_interfaces/srv/Increment_Request", data)
MAUVE_TYPE(mauve::testing::test_client::Increment::Response, "test_interfaces/srv/Increment_Response", data)
MAUVE_CALL_TYPE(mauve::testing::test_client::Increment, "test_interfaces/srv/Increment")

namespace mauve::testing::test_client {

using Calls = Client<Increment>;
using Port = CallPort<CallOf<Increment>>;

constexpr time_ns_t kHour = s_to_ns(3600);
constexpr const char* kType = "test_interfaces/srv/Increment";

std::uint32_t number_in(const std::vector<std::byte>& message) {
  Increment::Request request;
  EXPECT_TRUE(CdrReader(message).get(request));
  return request.data;
}
std::vector<std::byte> reply_of(std::uint32_t data) {
  std::vector<std::byte> message;
  CdrWriter(message).put(Increment::Response{data});
  return message;
}

/// Takes a client's requests on a thread of its own, as a bridge to ROS does.
class Carrier {
 public:
  using Handle = std::function<void(std::uint32_t number, const std::vector<std::byte>& request)>;

  Carrier(Notifier& told, Calls& client, Handle handle)
      : told_(told), client_(client), handle_(std::move(handle)) {
    client.set_notifier(&told);
    client.set_connected(true);
    thread_ = std::thread([this] { run(); });
  }
  ~Carrier() {
    ending_ = true;
    told_.notify();
    thread_.join();
  }
  Carrier(const Carrier&) = delete;
  Carrier& operator=(const Carrier&) = delete;

 private:
  void run() {
    while (!ending_) {
      const std::uint32_t word = told_.word();
      std::vector<std::byte> request;
      for (std::uint32_t number = 0; client_.next_request(request, number);) handle_(number, request);
      if (!ending_) told_.wait(word, kForever);
    }
  }

  Notifier& told_;
  Calls& client_;
  Handle handle_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

Carrier::Handle increments(Calls& client) {
  return [&client](std::uint32_t number, const std::vector<std::byte>& request) {
    client.answer(number, reply_of(number_in(request) + 1));
  };
}

struct ClientCall : ::testing::Test {
  Notifier told;
  Calls client{ms_to_ns(2)};
  Port port{"call", kType};

  ClientCall() { port.connect(client.call, "client"); }
  CallOutcome call(std::uint32_t data) { return port({data}, response); }
  Increment::Response response{};
};

TEST_F(ClientCall, WithoutAnybodyToCarryItEndsAtOnce) {
  EXPECT_EQ(CallOutcome::no_server, call(1));
  EXPECT_EQ(1U, client.counts().no_server);
}

TEST_F(ClientCall, IsAnswered) {
  Calls patient(kHour);
  Port through("call", kType);
  through.connect(patient.call, "patient");
  const Carrier carrier(told, patient, increments(patient));
  for (std::uint32_t i = 0; i < 1000; ++i) {
    ASSERT_EQ(CallOutcome::answered, through({i}, response));
    ASSERT_EQ(i + 1, response.data);
  }
  EXPECT_EQ(1000U, patient.counts().answered);
  EXPECT_GT(patient.counts().longest_ns, 0);
}

TEST_F(ClientCall, TimesOutAndIsNotAnsweredByALateReply) {
  std::atomic<std::uint32_t> taken{0};
  {
    const Carrier carrier(told, client, [&](std::uint32_t number, const auto&) { taken = number; });
    response.data = 77;
    const time_ns_t began = monotonic_now_ns();
    EXPECT_EQ(CallOutcome::timed_out, call(1));
    EXPECT_GE(monotonic_now_ns() - began, client.timeout_ns());
    EXPECT_EQ(77U, response.data) << "untouched";
    client.answer(1, reply_of(2));  // the first call's number, for which nobody waits any more
    EXPECT_EQ(CallOutcome::timed_out, call(10));
  }
  EXPECT_EQ(2U, client.counts().timed_out);
  EXPECT_LE(taken.load(), 2U);
}

TEST_F(ClientCall, ThatWasGivenUpIsNotSentAnyMore) {
  client.set_notifier(&told);
  client.set_connected(true);
  EXPECT_EQ(CallOutcome::timed_out, call(1));
  std::vector<std::byte> request;
  std::uint32_t number = 0;
  EXPECT_FALSE(client.next_request(request, number));
}

TEST_F(ClientCall, IsRefusedWhileAnotherIsUnderWay) {
  Calls patient(kHour);
  Port through("call", kType);
  through.connect(patient.call, "patient");
  std::atomic<bool> taken{false};
  std::atomic<bool> may_answer{false};
  const Carrier carrier(told, patient, [&](std::uint32_t number, const auto& request) {
    taken = true;
    while (!may_answer) std::this_thread::yield();
    patient.answer(number, reply_of(number_in(request) + 1));
  });
  Increment::Response first;
  CallOutcome outcome = CallOutcome::busy;
  std::thread other([&] { outcome = through({1}, first); });
  Port second("call", kType);
  second.connect(patient.call, "patient");
  wait_until([&] { return taken.load(); }, "the first call");
  EXPECT_EQ(CallOutcome::busy, second({5}, response));
  may_answer = true;
  other.join();
  EXPECT_EQ(CallOutcome::answered, outcome);
  EXPECT_EQ(2U, first.data);
}

TEST_F(ClientCall, TellsOfAReplyThatDoesNotFitAndOfARefusal) {
  Calls patient(kHour);
  Port through("call", kType);
  through.connect(patient.call, "patient");
  const Carrier carrier(told, patient, [&](std::uint32_t number, const auto& request) {
    if (number_in(request) == 0) return patient.answer(number, {});
    patient.refuse(number, CallOutcome::no_server);
  });
  EXPECT_EQ(CallOutcome::malformed, through({0}, response));
  EXPECT_EQ(CallOutcome::no_server, through({1}, response));
}

/// Replies that come before, at and after the end of the wait: each that counts is of its own request.
TEST_F(ClientCall, IsNeverAnsweredByTheReplyToAnother) {
  Calls hasty(us_to_ns(60));
  Port through("call", kType);
  through.connect(hasty.call, "hasty");
  const Carrier carrier(told, hasty, [&](std::uint32_t number, const auto& request) {
    std::this_thread::sleep_for(std::chrono::microseconds(number * 37 % 120));
    hasty.answer(number, reply_of(number_in(request) + 1));
  });
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const CallOutcome outcome = through({i}, response);
    if (outcome == CallOutcome::answered) {
      ASSERT_EQ(i + 1, response.data);
    } else {
      ASSERT_EQ(CallOutcome::timed_out, outcome);
    }
  }
  EXPECT_EQ(3000U, hasty.counts().answered + hasty.counts().timed_out);
}

TEST(OfferedCall, IsReachedByMessagesToo) {
  struct Doubles final : RequestService<Increment> {
    Doubles() : RequestService("double") {}
    CallOutcome call(const Increment::Request& request, Increment::Response& response) override {
      if (request.data == 0) return CallOutcome::busy;
      response.data = 2 * request.data;
      return CallOutcome::answered;
    }
  } doubles;
  std::vector<std::byte> request;
  std::vector<std::byte> reply;
  CdrWriter(request).put(Increment::Request{21});
  EXPECT_EQ(CallOutcome::answered, doubles.call_serialized(request, reply));
  EXPECT_EQ(reply_of(42), reply);
  request.resize(5);
  EXPECT_EQ(CallOutcome::malformed, doubles.call_serialized(request, reply));
  CdrWriter(request).put(Increment::Request{0});
  EXPECT_EQ(CallOutcome::busy, doubles.call_serialized(request, reply));
}

TEST(ClientTimeout, MustBeATime) {
  EXPECT_THROW(Calls(0), Error);
  EXPECT_THROW(Calls(-1), Error);
}

TEST(ClientByName, IsMadeFromARegisteredCallType) {
  PluginRegistry registry;
  registry.call_type<Increment>();
  registry.call_type<Increment>();  // by another package
  const auto made = registry.make_resource("client", kType, {{"timeout_ns", 5}});
  ASSERT_NE(nullptr, made->client());
  EXPECT_EQ(5, made->client()->timeout_ns());
  EXPECT_THAT(registry.names("call_type"), ::testing::ElementsAre(kType));
  EXPECT_THAT(registry.names("type"), ::testing::ElementsAre("mauve_msgs/msg/ActionGoal"));
  try {
    registry.make_resource("client", "test_interfaces/srv/Other", {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::unknown_type, error.code());
    EXPECT_THAT(error.what(), ::testing::HasSubstr(kType)) << "what there is";
  }
}

/// A component of 1 ms that calls at every activation.
class CallingComponent : public Deployed {
 protected:
  Component& add_calling(Calls& client) {
    Component& component = add("c", 1);
    port.connect(client.call, "client");
    core(component).work = [this] {
      last = port({static_cast<std::uint32_t>(made.load())}, response);
      ++made;
    };
    return component;
  }
  Port port{"call", kType};
  Increment::Response response{};
  std::atomic<int> made{0};
  std::atomic<CallOutcome> last{CallOutcome::busy};
  ComponentsEndFirst end{deployer};
};

TEST_F(CallingComponent, IsAnsweredWithoutAllocation) {
  auto& client = architecture.add_resource<Calls>("client", kHour);
  const Carrier carrier(architecture.publications(), client, increments(client));
  Component& component = add_calling(client);
  deploy();
  wait_until([&] { return made.load() > 100; }, "calls");
  EXPECT_EQ(0U, component.task().counters().allocations());
  deployer.shutdown();  // may come in the middle of a call
  const bool is_last_stopped = last.load() == CallOutcome::stopped;
  if (!is_last_stopped) {
    EXPECT_EQ(CallOutcome::answered, last.load());
  }
  EXPECT_EQ(client.counts().answered, static_cast<std::uint64_t>(made.load()) - (is_last_stopped ? 1U : 0U));
}

TEST_F(CallingComponent, StopsInTheMiddleOfACall) {
  auto& client = architecture.add_resource<Calls>("client", kHour);
  std::atomic<int> taken{0};
  const Carrier carrier(architecture.publications(), client, [&](std::uint32_t, const auto&) { ++taken; });
  Component& component = add_calling(client);
  deploy();
  for (int i = 1; i <= 300; ++i) {
    wait_until([&] { return taken.load() >= i; }, "the request");
    deployer.stop("c", s_to_ns(20));
    ASSERT_EQ(ComponentState::stopped, component.task().state());
    ASSERT_EQ(CallOutcome::stopped, last.load());
    ASSERT_EQ(i, made.load());
    if (i < 300) deployer.start("c");
  }
  deployer.shutdown();
}

TEST_F(CallingComponent, HasItsCallTracedByName) {
  auto& client = architecture.add_resource<Calls>("client", ms_to_ns(1));
  add_calling(client);
  deploy();
  wait_until([&] { return made.load() > 3; }, "calls");
  deployer.shutdown();
  EXPECT_EQ(CallOutcome::no_server, last.load());
  const auto begun = records_of(deployer.drain_trace(), TraceKind::service_begin);
  ASSERT_GE(begun.size(), 3U);
  EXPECT_EQ("client.call", TraceNames::word(begun[0].name));
}

/// In virtual time nobody is there to answer: a simulation never waits for one.
TEST_F(Simulated, CallsOfAClientEndAtOnce) {
  auto& client = architecture.add_resource<Calls>("client", kHour);
  Port port("call", kType);
  port.connect(client.call, "client");
  Component& component = add("c", 1);
  int ended = 0;
  Increment::Response response;
  core(component).work = [&] { ended += port({1}, response) == CallOutcome::no_server ? 1 : 0; };
  deploy();
  run_to(ms_to_ns(5));
  EXPECT_EQ(6, ended);
}

/// What a transaction adds tells who carries it outside, as what was there from the start.
TEST(Transaction, AddsWhatIsCarriedOutside) {
  PluginRegistry registry;
  registry.call_type<Increment>();
  register_parts(registry);
  Architecture with(&registry);
  Deployer deployed(with);
  const ComponentsEndFirst guard(deployed);
  with.add_component("c", "t/Shell", "t/Core", "t/Fsm", {});
  with.configure();
  deployed.deploy();
  Transaction add;
  add.add_resource("calls", "client", kType, {{"timeout_ns", ms_to_ns(1)}})
      .add_resource("beat", "shared_data", kNumberType, {}, TopicBinding::publish)
      .add_resource("quiet", "shared_data", kNumberType)
      .connect("c", "output", "quiet", "write");
  deployed.commit(std::move(add));
  Notifier& told = with.publications();
  std::uint32_t word = told.word();
  auto& calls = dynamic_cast<Calls&>(with.resource("calls"));
  calls.set_connected(true);
  Increment::Response response;
  EXPECT_EQ(CallOutcome::timed_out, calls.call.call({1}, response));
  EXPECT_NE(word, told.word());
  word = told.word();
  dynamic_cast<SharedData<Number>&>(with.resource("quiet")).write.write({1.0}, 1);
  EXPECT_EQ(word, told.word());
  dynamic_cast<SharedData<Number>&>(with.resource("beat")).write.write({2.0}, 1);
  EXPECT_NE(word, told.word());
  std::string resource;
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  ASSERT_TRUE(with.next_published(resource, message, time_ns));
  EXPECT_EQ("beat", resource);
  EXPECT_FALSE(with.next_published(resource, message, time_ns));
  Transaction remove;
  remove.remove_resource("beat").remove_resource("calls");
  deployed.commit(std::move(remove));
  EXPECT_FALSE(with.next_published(resource, message, time_ns));
}

}  // namespace mauve::testing::test_client

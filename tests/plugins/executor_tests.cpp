// SPDX-License-Identifier: LGPL-3.0-or-later
// A small package of plug-ins for the executor's tests: a component that counts, in every temper.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "mauve_rt/mauve_rt.hpp"

namespace executor_tests {

struct Number {
  double data{};
};

struct Point {
  double x{};
  double y{};
  double z{};
};

/// As sensor_msgs has it.
struct JointState {
  struct Time {
    std::int32_t sec{};
    std::uint32_t nanosec{};
  };
  struct Header {
    Time stamp;
    mauve::BoundedString<255> frame_id;
  };
  Header header;
  mauve::Sequence<mauve::BoundedString<255>> name;
  mauve::Sequence<double> position;
  mauve::Sequence<double> velocity;
  mauve::Sequence<double> effort;
};

/// Not a ROS message.
struct Private {
  double value{};
};

/// Not a ROS message either, with every kind of field.
struct Attitude {
  double roll{};
  std::array<float, 3> rates{};
  Point origin{};
  std::array<Point, 2> corners{};
  mauve::BoundedVector<std::int32_t, 4> codes;
  mauve::BoundedString<16> mode;
  bool level{};
  std::uint64_t round{};
};

/// One that cannot be copied as bytes.
struct Owning {
  Owning() = default;
  Owning(const Owning& other) : value(other.value) {}
  Owning& operator=(const Owning& other) {
    value = other.value;
    return *this;
  }
  double value{};
};

struct SetBool {
  struct Request {
    bool data{};
  };
  struct Response {
    bool success{};
    mauve::BoundedString<16> message;
  };
};

struct OutputStep {
  mauve::BoundedString<64> output;
  double greatest{};
  double difference{};
  double least{};
  std::int64_t least_instant_ns{};
  double step{};
};

struct StepReport {
  mauve::BoundedString<64> step;
  mauve::BoundedString<32> component;
  std::int64_t prepare_ns{};
  std::int64_t blackout_ns{};
  std::int64_t missed_releases{};
  std::int64_t phase_nominal_ns{};
  std::int64_t phase_actual_ns{};
  mauve::BoundedString<64> from_core;
  mauve::BoundedString<64> to_core;
  mauve::BoundedString<128> remark;
  std::int64_t instant_ns{};
  std::int64_t release_ns{};
  mauve::BoundedVector<mauve::BoundedString<64>, 4> taken;
  mauve::BoundedVector<mauve::BoundedString<64>, 4> left;
  mauve::BoundedVector<OutputStep, 4> outputs;
};

struct Stop {
  struct Request {
    mauve::BoundedString<16> request_id;
    std::uint64_t expected_revision{};
    mauve::BoundedString<16> requested_by;
    mauve::BoundedString<16> cause;
    mauve::BoundedString<16> component;
    double timeout_s{};
    bool force{};
  };
  struct Response {
    bool success{};
    std::uint16_t code{};
    mauve::BoundedString<512> message;
    mauve::BoundedString<64> instance_id;
    std::uint64_t revision{};
    mauve::BoundedVector<StepReport, 4> report;
  };
};

struct PoseStamped {
  JointState::Header header;
  struct Pose {
    Point position;
    struct Quaternion {
      double x{};
      double y{};
      double z{};
      double w{1};
    } orientation;
  } pose;
};

struct DriveTo {
  struct Goal {
    PoseStamped pose;
    double tolerance_m{};
  };
  struct Result {
    double distance_m{};
    bool reached{};
  };
  struct Feedback {
    double distance_m{};
    double elapsed_s{};
  };
};

struct Trigger {
  struct Request {};
  struct Response {
    bool success{};
    mauve::BoundedString<16> message;
  };
};

}  // namespace executor_tests

MAUVE_TYPE(executor_tests::Number, "std_msgs/msg/Float64", data)
MAUVE_TYPE(executor_tests::Point, "geometry_msgs/msg/Point", x, y, z)
MAUVE_TYPE(executor_tests::JointState::Time, "builtin_interfaces/msg/Time", sec, nanosec)
MAUVE_TYPE(executor_tests::JointState::Header, "std_msgs/msg/Header", stamp, frame_id)
MAUVE_TYPE(executor_tests::JointState, "sensor_msgs/msg/JointState", header, name, position, velocity, effort)
MAUVE_TYPE(executor_tests::Private, "executor_tests/Private", value)
MAUVE_TYPE(executor_tests::Attitude, "executor_tests/Attitude", roll, rates, origin, corners, codes, mode,
           level, round)
MAUVE_TYPE(executor_tests::Owning, "executor_tests/Owning", value)
MAUVE_TYPE(executor_tests::SetBool::Request, "std_srvs/srv/SetBool_Request", data)
MAUVE_TYPE(executor_tests::SetBool::Response, "std_srvs/srv/SetBool_Response", success, message)
MAUVE_CALL_TYPE(executor_tests::SetBool, "std_srvs/srv/SetBool")
MAUVE_TYPE(executor_tests::PoseStamped::Pose::Quaternion, "geometry_msgs/msg/Quaternion", x, y, z, w)
MAUVE_TYPE(executor_tests::PoseStamped::Pose, "geometry_msgs/msg/Pose", position, orientation)
MAUVE_TYPE(executor_tests::PoseStamped, "geometry_msgs/msg/PoseStamped", header, pose)
MAUVE_TYPE(executor_tests::DriveTo::Goal, "mauve_msgs/action/DriveTo_Goal", pose, tolerance_m)
MAUVE_TYPE(executor_tests::DriveTo::Result, "mauve_msgs/action/DriveTo_Result", distance_m, reached)
MAUVE_TYPE(executor_tests::DriveTo::Feedback, "mauve_msgs/action/DriveTo_Feedback", distance_m, elapsed_s)
MAUVE_ACTION_TYPE(executor_tests::DriveTo, "mauve_msgs/action/DriveTo")
MAUVE_TYPE(executor_tests::Stop::Request, "mauve_msgs/srv/Stop_Request", request_id, expected_revision,
           requested_by, cause, component, timeout_s, force)
MAUVE_TYPE(executor_tests::OutputStep, "mauve_msgs/msg/OutputStep", output, greatest, difference, least,
           least_instant_ns, step)
MAUVE_TYPE(executor_tests::StepReport, "mauve_msgs/msg/StepReport", step, component, prepare_ns, blackout_ns,
           missed_releases, phase_nominal_ns, phase_actual_ns, from_core, to_core, remark, instant_ns,
           release_ns, taken, left, outputs)
MAUVE_TYPE(executor_tests::Stop::Response, "mauve_msgs/srv/Stop_Response", success, code, message,
           instance_id, revision, report)
MAUVE_CALL_TYPE(executor_tests::Stop, "mauve_msgs/srv/Stop")
MAUVE_TYPE(executor_tests::Trigger::Request, "std_srvs/srv/Trigger_Request")
MAUVE_TYPE(executor_tests::Trigger::Response, "std_srvs/srv/Trigger_Response", success, message)
MAUVE_CALL_TYPE(executor_tests::Trigger, "std_srvs/srv/Trigger")

namespace executor_tests {

struct CounterShell : mauve::Shell {
  mauve::Property<double>& step = property("step", 1.0, {.unit = "1", .minimum = 0.0, .maximum = 10.0});
  mauve::Property<std::int64_t>& period_ms = property("period_ms", 10, {.structural = mauve::ReadBy::fsm});
  mauve::Property<bool>& enabled = property("enabled", true);
  mauve::Property<std::string>& label = property("label", "");
  mauve::Property<std::string>& list_file = property("list_file", "");
  mauve::ReadPort<Number>& set = read_port<Number>("set").optional();
  mauve::WritePort<Number>& count = write_port<Number>("count").optional();
};

/// Ends the process. A fault of the processor: threads of components block signals that are sent.
inline void write_where_nothing_may() {
  void* const forbidden = mmap(nullptr, 1, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  *static_cast<volatile char*>(forbidden) = 1;
}

/// Ends the process: every call takes room of the stack, and needs it after the next one.
[[gnu::noinline]] inline std::size_t overflow_stack(std::size_t depth) {
  std::array<char, 4096> room{};
  asm volatile("" : : "r"(room.data()) : "memory");  // it is used, and may be changed
  return depth == 0 ? 0 : overflow_stack(depth + 1) + static_cast<std::size_t>(room[depth % room.size()]);
}

struct Counter : mauve::Core<CounterShell> {
  double count = 0.0;

  virtual void act() {
    if (const auto sample = shell().set.read(); sample.is_new()) {
      if (sample.value.data == -2e8) throw 42;
      if (sample.value.data == -2e7) throw std::runtime_error("bytes \xff\xfe, no text");
      if (sample.value.data == -3e8) write_where_nothing_may();
      if (sample.value.data == -4e8) std::abort();
      if (sample.value.data == -5e8) overflow_stack(1);
      if (sample.value.data < -1e6) throw std::runtime_error("set to something unheard of");
      count = sample.value.data;
    }
    count += shell().step.value();
    shell().count.write({count});
    log().debug("counted to {:.1f} by {}", count, shell().step.value());
  }
  void take(mauve::CoreBase& old) noexcept override {
    if (auto* other = dynamic_cast<Counter*>(&old)) count = other->count;
  }
};

/// Counts downwards.
struct Backwards : Counter {
  void act() override {
    count -= shell().step.value();
    shell().count.write({count});
  }
};

/// Installed, but no architecture file of the tests declares it.
struct Undeclared : Counter {};

struct Reluctant : Counter {
  bool adopt(const mauve::CoreBase&) override { return false; }
};

/// Fails in bytes that are no text.
struct UnspeakableResource : mauve::Resource {
  UnspeakableResource() : Resource("executor_tests/UnspeakableResource", "") {
    throw std::out_of_range("\xc3\x28 is no text");
  }
};

/// Returns when there is a file that `label` names, or after a minute; says by a file beside it that it waits.
inline void await_file(const std::string& label) {
  namespace fs = std::filesystem;
  const fs::path awaited = label;
  std::ofstream(fs::path(awaited).replace_extension(".begun")) << '\n';
  const mauve::time_ns_t until = mauve::monotonic_now_ns() + mauve::s_to_ns(60);
  while (!fs::exists(awaited) && mauve::monotonic_now_ns() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

/// Is being configured until there is a file, as PyPatient of executor_tests_cores.py.
struct Patient : Counter {
 protected:
  bool configure_hook() override {
    await_file(shell().label.value());
    return true;
  }
};

/// Looks at the old core until there is a file.
struct Clinging : Counter {
  bool adopt(const mauve::CoreBase&) override {
    await_file(shell().label.value());
    return true;
  }
};

/// Says no in bytes that are no text.
struct Unspeakable : Counter {
 protected:
  bool configure_hook() override { throw std::invalid_argument("\xc3\x28 is no text"); }
};

struct Unready : Counter {
 protected:
  bool configure_hook() override {
    log().error("nothing is there to get ready with");
    throw std::runtime_error("the core is not ready, and never will be");
  }
};

/// Allocates four times an activation, as careless code does.
struct Wasteful : Counter {
  std::unique_ptr<double> number;
  std::vector<double> row;
  std::string text;
  std::unique_ptr<double[]> rows;

  void act() override {
    number = std::make_unique<double>(count);
    row = std::vector<double>(100, count);
    text = std::string(100, 'x');
    rows = std::make_unique<double[]>(100);
    Counter::act();
  }
};

/// Executes for a second at a time.
struct Slow : Counter {
  void act() override {
    const mauve::time_ns_t until = mauve::monotonic_now_ns() + mauve::s_to_ns(1);
    while (mauve::monotonic_now_ns() < until) {
    }
  }
};

/// Executes for so many milliseconds, and not less.
inline void spin_for(double time_ms) {
  const mauve::time_ns_t until = mauve::monotonic_now_ns() + static_cast<mauve::time_ns_t>(time_ms * 1e6);
  while (mauve::monotonic_now_ns() < until) {
  }
}

/// Executes for `step` milliseconds.
struct Spinning : Counter {
  void act() override { spin_for(shell().step.value()); }
};

/// Executes until it receives a number; counts -1 when it begins. Gives up after half a minute; after three seconds where
/// its label is "briefly": a condemned component receives nothing.
struct Held : Counter {
  void act() override {
    shell().count.write({-1.0});
    const int longest_s = std::string(shell().label.value()) == "briefly" ? 3 : 30;
    const mauve::time_ns_t until = mauve::monotonic_now_ns() + mauve::s_to_ns(longest_s);
    while (!shell().set.read().is_new() && mauve::monotonic_now_ns() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
};

/// Does not come out of its third activation in the way that `label` says: loop (until it is told a number), sleep (for
/// four seconds), lock (a second time what it holds), or the path of a pipe to read from.
struct Hanging : Counter {
  int acts = 0;
  std::mutex mutex;

  void act() override {
    if (++acts == 3) hang(shell().label.value());
    Counter::act();
  }
  void hang(const std::string& how) {
    if (how == "loop") {
      while (!shell().set.read().is_new()) {
      }
    } else if (how == "sleep") {
      std::this_thread::sleep_for(std::chrono::seconds(4));
    } else if (how == "lock") {
      mutex.lock();
      mutex.lock();
    } else if (!how.empty()) {
      char byte = 0;
      const int pipe = open(how.c_str(), O_RDONLY | O_CLOEXEC);
      if (read(pipe, &byte, 1) != 1) throw std::runtime_error("the pipe was closed");
      close(pipe);
    }
  }
};

struct CounterFsm : mauve::Fsm<CounterShell, Counter> {
  void define() override {
    mauve::State& run = execution("Count", "act", &Counter::act);
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// Declares how long an execution may last.
struct GuardedFsm : mauve::Fsm<CounterShell, Counter> {
  void define() override {
    mauve::State& run = execution("Count", "act", &Counter::act, mauve::ms_to_ns(500));
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// Waits three times as long.
struct CalmFsm : mauve::Fsm<CounterShell, Counter> {
  void define() override {
    mauve::State& run = execution("Count", "act", &Counter::act);
    mauve::State& rest = wait("Rest", 3 * mauve::ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, rest);
    next(rest, run);
  }
};

/// Waits for somebody to set the count.
struct EventFsm : mauve::Fsm<CounterShell, Counter> {
  void define() override {
    mauve::State& run = execution("Count", "act", &Counter::act);
    mauve::State& heard = wait_event("Heard", shell().set, mauve::s_to_ns(1), mauve::ms_to_ns(1));
    set_initial(run);
    next(run, heard);
    next(heard, run);
  }
};

/// Never waits.
struct LoopFsm : mauve::Fsm<CounterShell, Counter> {
  void define() override {
    mauve::State& run = execution("Count", "act", &Counter::act);
    mauve::State& again = execution("CountAgain", "act", &Counter::act);
    set_initial(run);
    next(run, again);
    next(again, run);
  }
};

/// Has the unit of its fsm's waits, and declares the policies of an output.
struct TimedShell : CounterShell {
  mauve::Property<std::int64_t>& unit_ms = property(
      "unit_ms", 10, {.unit = "ms", .minimum = 1, .maximum = 1000, .structural = mauve::ReadBy::fsm});
  mauve::WritePort<Number>& kept = write_port<Number>("kept", {.on_commit = mauve::OutputPolicy::set_zero,
                                                               .on_stop = mauve::OutputPolicy::hold})
                                       .optional();
};

/// Declares worst-case execution times where it is registered.
struct Timed : Counter {
  MAUVE_STATE(count)
 public:
  bool is_enabled() const { return shell().enabled; }
  mauve::time_ns_t budget_ns() const noexcept override { return mauve::us_to_ns(100); }
};

struct TimedFsm : mauve::Fsm<TimedShell, Timed> {
  void define() override {
    mauve::State& run = execution("Count", "act", &Timed::act);
    mauve::State& again = execution("Again", "act", &Timed::act);
    mauve::State& pause = wait("Pause", mauve::times(5, shell().unit_ms));
    mauve::State& event =
        wait_event("Event", shell().set, mauve::times(3, shell().unit_ms), mauve::times(1, shell().unit_ms));
    set_initial(run);
    transition(run, "is_enabled", &Timed::is_enabled, pause);
    next(run, event);
    next(pause, run);
    next(event, again);
    next(again, pause);
  }
};

struct OtherShell : mauve::Shell {};

/// A counter's shell by another author: a port less, a property more.
struct TwinShell : mauve::Shell {
  mauve::Property<double>& step = property("step", 1.0, {.unit = "1", .minimum = 0.0, .maximum = 10.0});
  mauve::Property<double>& factor = property("factor", 2.0);
  mauve::WritePort<Number>& count = write_port<Number>("count").optional();
};

struct Twin : mauve::Core<TwinShell> {
  double count = 0.0;
  void act() {
    count += shell().step.value() * shell().factor.value();
    shell().count.write({count});
  }
};

struct TwinFsm : mauve::Fsm<TwinShell, Twin> {
  void define() override {
    mauve::State& run = execution("Count", "act", &Twin::act);
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(10));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// Turns the joints of each message the other way, every 10 ms.
struct JointShell : mauve::Shell {
  mauve::ReadPort<JointState>& input = read_port<JointState>("input");
  mauve::WritePort<JointState>& output = write_port<JointState>("output");
};

struct JointTurner : mauve::Core<JointShell> {
  virtual void act() {
    shell().input.with([&](const JointState& joints) {
      if (shell().input.status() != mauve::DataStatus::new_data) return;
      shell().output.write_with([&](JointState& turned) {
        turned = joints;
        for (double& position : turned.position) position = -position;
      });
    });
  }
};

/// Passes each message on by a member of its own.
struct JointKeeper : JointTurner {
  JointState kept;

  bool configure_hook() override {
    kept = shell().input.prototype();
    return true;
  }
  void act() override {
    if (shell().input.read(kept) == mauve::DataStatus::new_data) shell().output.write(kept);
  }
};

struct JointFsm : mauve::Fsm<JointShell, JointTurner> {
  void define() override {
    mauve::State& run = execution("Turn", "act", &JointTurner::act);
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(10));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// Writes to each kind of resource, every 10 ms.
struct PilotShell : mauve::Shell {
  mauve::WritePort<Attitude>& attitude = write_port<Attitude>("attitude");
  mauve::WritePort<Point>& place = write_port<Point>("place").optional();
  mauve::WritePort<Number>& latest = write_port<Number>("latest").optional();
  mauve::WritePort<Number>& queue = write_port<Number>("queue").optional();
  mauve::ReadPort<Attitude>& felt = read_port<Attitude>("felt").optional();
  mauve::EventPort& beat = event_port("beat").optional();
};

struct Pilot : mauve::Core<PilotShell> {
  Attitude attitude;

  void act() {
    ++attitude.round;
    attitude.roll = static_cast<double>(attitude.round) / 2;
    attitude.rates = {0.5F, static_cast<float>(attitude.round), -1.5F};
    attitude.origin = {1.0, 2.0, 3.0};
    attitude.corners = {Point{4.0, 5.0, 6.0}, Point{7.0, 8.0, static_cast<double>(attitude.round)}};
    static_cast<void>(attitude.codes.resize(attitude.round % 3));
    static_cast<void>(attitude.mode.assign("cruise"));
    attitude.level = attitude.round % 2 == 0;
    shell().attitude.write(attitude);
    shell().place.write({attitude.roll, 0.25, -1.0});
    shell().latest.write({attitude.roll});
    static_cast<void>(shell().queue.write({attitude.roll}));
    shell().beat.raise();
  }
};

struct PilotFsm : mauve::Fsm<PilotShell, Pilot> {
  void define() override {
    mauve::State& run = execution("Fly", "act", &Pilot::act);
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(10));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// Calls at every activation, with true and false in turns.
struct CallerShell : mauve::Shell {
  mauve::Property<std::int64_t>& period_ms = property("period_ms", 10, {.structural = mauve::ReadBy::fsm});
  mauve::CallPort<mauve::CallOf<SetBool>>& lamp = call_port<SetBool>("lamp");
  mauve::WritePort<Number>& count = write_port<Number>("count").optional();
};

/// Counts answers; says how a call ended that was not answered by minus its outcome.
struct Caller : mauve::Core<CallerShell> {
  int answered = 0;

  void act() {
    SetBool::Response response;
    const mauve::CallOutcome outcome = shell().lamp({answered % 2 == 0}, response);
    if (outcome != mauve::CallOutcome::answered) {
      shell().count.write({-static_cast<double>(outcome)});
    } else if (response.success && response.message == (answered % 2 == 0 ? "on" : "off")) {
      shell().count.write({static_cast<double>(++answered)});
    }
  }
};

struct CallerFsm : mauve::Fsm<CallerShell, Caller> {
  void define() override {
    mauve::State& run = execution("Call", "act", &Caller::act);
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// Drives along x by 1 m in each release, and says how far it is.
struct DriverShell : mauve::Shell {
  mauve::Property<std::int64_t>& period_ms = property("period_ms", 10, {.structural = mauve::ReadBy::fsm});
  mauve::ActionServerPorts<DriveTo> drive = action_server<DriveTo>("drive");
};
struct Driver : mauve::Core<DriverShell> {
  MAUVE_STATE(goal, driven)

 public:
  std::uint32_t goal{0};
  double driven{0.0};

  void act() {
    auto& drive = shell().drive;
    const mauve::ActionGoal status = drive.status.read().value;
    if (status.number == 0) return;
    if (status.number != goal) {
      goal = status.number;
      driven = 0.0;
    }
    const double left = drive.goal.read().value.pose.pose.position.x - driven;
    if (status.its_state() == mauve::GoalState::canceling) {
      drive.cancel({.distance_m = left, .reached = false});
    } else if (left < 0.0) {
      drive.abort({.distance_m = left, .reached = false});
    } else if (left == 0.0) {
      drive.succeed({.distance_m = 0.0, .reached = true});
    } else {
      driven += 1.0;
      drive.feedback.write({.distance_m = left - 1.0, .elapsed_s = driven});
    }
  }
};
/// Does not look at its goals.
struct Asleep : mauve::Core<DriverShell> {
  void act() {}
};
template <typename CoreType>
struct DriverFsmOf : mauve::Fsm<DriverShell, CoreType> {
  void define() override {
    mauve::State& run = this->execution("Drive", "act", &CoreType::act);
    mauve::State& pause = this->wait("Pause", mauve::ms_to_ns(this->shell().period_ms.value()));
    this->set_initial(run);
    this->next(run, pause);
    this->next(pause, run);
  }
};

/// Sends the goals that it reads, one after another; says its number and state.
struct PassengerShell : mauve::Shell {
  mauve::ReadPort<Number>& wish = read_port<Number>("wish");
  mauve::ActionClientPorts<DriveTo> drive = action_client<DriveTo>("drive");
  mauve::WritePort<Number>& said = write_port<Number>("said");
};
struct Passenger : mauve::Core<PassengerShell> {
  void act() {
    auto& drive = shell().drive;
    const auto wish = shell().wish.read();
    if (wish.is_new() && wish.value.data >= 0.0) {
      DriveTo::Goal goal;
      goal.pose.pose.position.x = wish.value.data;
      drive.send(goal);
    } else if (wish.is_new()) {
      drive.cancel();
    }
    const mauve::ActionGoal status = drive.status.read().value;
    shell().said.write({status.number * 1000.0 + status.state * 100.0 + status.reason});
  }
};
struct PassengerFsm : mauve::Fsm<PassengerShell, Passenger> {
  void define() override {
    mauve::State& run = execution("Look", "act", &Passenger::act);
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(10));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// Asks for the stop of a component whose name is no text; says the reply's code.
struct StopperShell : mauve::Shell {
  mauve::CallPort<mauve::CallOf<Stop>>& stop = call_port<Stop>("stop");
  mauve::WritePort<Number>& count = write_port<Number>("count").optional();
};
struct Stopper : mauve::Core<StopperShell> {
  void act() {
    Stop::Request request;
    for (auto* text : {&request.component, &request.cause, &request.requested_by})
      text->assign("\xff\xc3(\xf0\x9f");
    Stop::Response response;
    if (shell().stop(request, response) != mauve::CallOutcome::answered) return;
    shell().count.write({static_cast<double>(response.success ? 0 : response.code)});
  }
};
struct StopperFsm : mauve::Fsm<StopperShell, Stopper> {
  void define() override {
    mauve::State& run = execution("Ask", "act", &Stopper::act);
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(50));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// A lamp to switch and to ask, by components and, where a file offers them, by ROS.
class Lamp final : public mauve::Resource {
 public:
  Lamp() : Resource("executor_tests/Lamp", "") {
    offer(set);
    offer(ask);
    offer(look);
  }

 private:
  class Set final : public mauve::RequestService<SetBool> {
   public:
    explicit Set(Lamp& owner) : RequestService("set"), owner_(owner) {}
    mauve::CallOutcome call(const SetBool::Request& request, SetBool::Response& response) override {
      const std::lock_guard lock(owner_.mutex_);
      owner_.is_on_ = request.data;
      response.success = true;
      response.message.assign(owner_.is_on_ ? "on" : "off");
      return mauve::CallOutcome::answered;
    }

   private:
    Lamp& owner_;
  };
  class Ask final : public mauve::RequestService<Trigger> {
   public:
    explicit Ask(Lamp& owner) : RequestService("ask"), owner_(owner) {}
    mauve::CallOutcome call(const Trigger::Request& /*request*/, Trigger::Response& response) override {
      const std::lock_guard lock(owner_.mutex_);
      if (!owner_.is_on_) throw std::runtime_error("nobody is at home");
      response.success = true;
      response.message.assign("on");
      return mauve::CallOutcome::answered;
    }

   private:
    Lamp& owner_;
  };
  /// A call that no ROS service is.
  class Look final : public mauve::CallService<bool()> {
   public:
    explicit Look(Lamp& owner) : CallService("look", "executor_tests/Look"), owner_(owner) {}
    bool call() override {
      const std::lock_guard lock(owner_.mutex_);
      return owner_.is_on_;
    }

   private:
    Lamp& owner_;
  };

  mauve::PiMutex mutex_;
  bool is_on_{false};

 public:
  Set set{*this};
  Ask ask{*this};
  Look look{*this};
};

/// Executes for `hold_ms` under the lock of a vault.
struct LockingShell : mauve::Shell {
  mauve::Property<double>& hold_ms =
      property("hold_ms", 0.0, {.unit = "ms", .minimum = 0.0, .maximum = 100.0});
  mauve::Property<std::int64_t>& period_ms = property("period_ms", 10, {.structural = mauve::ReadBy::fsm});
  mauve::CallPort<void(double)>& vault = call_port<void(double)>("vault", "executor_tests/Hold");
};

struct Locking : mauve::Core<LockingShell> {
  void act() { shell().vault(shell().hold_ms.value()); }
};

struct LockingFsm : mauve::Fsm<LockingShell, Locking> {
  void define() override {
    mauve::State& run = execution("Lock", "act", &Locking::act);
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// A lock that is held for as long as the caller says.
class Vault final : public mauve::Resource {
 public:
  Vault() : Resource("executor_tests/Vault", "") { offer(hold); }
  void set_name(const std::string& name) override {
    Resource::set_name(name);
    mutex_.set_trace_id(mauve::TraceNames::intern(name));
  }

 private:
  class Hold final : public mauve::CallService<void(double)> {
   public:
    explicit Hold(Vault& owner) : CallService("hold", "executor_tests/Hold"), owner_(owner) {}
    void call(double time_ms) override {
      const std::lock_guard lock(owner_.mutex_);
      spin_for(time_ms);
    }

   private:
    Vault& owner_;
  };

  mauve::PiMutex mutex_;

 public:
  Hold hold{*this};
};

/// What is read is what it was told.
class Window final : public mauve::Resource {
 public:
  static std::vector<mauve::ResourceParameter> parameters() {
    return {{.name = "length_s",
             .initial = 0.5,
             .description = "how far it looks back",
             .unit = "s",
             .minimum = 0.25,
             .maximum = 60.0},
            {.name = "label", .initial = "", .description = "what it is for", .is_required = true}};
  }

  explicit Window(const mauve::ResourceParameters& given)
      : Resource("executor_tests/Window", ""), length_s_(mauve::get<double>(given, "length_s")) {
    offer(read);
    set_longest_hold_ns(3'000'000);
  }

 private:
  class Read final : public mauve::ReadService<Number> {
   public:
    explicit Read(Window& owner) : ReadService("read"), owner_(owner) {}
    mauve::DataStatus read(Number& value, mauve::time_ns_t& time_ns,
                           mauve::ReaderState& reader) noexcept override {
      value.data = owner_.length_s_;
      time_ns = 1;
      return reader.look(1);
    }

   private:
    Window& owner_;
  };

  const double length_s_;

 public:
  Read read{*this};
};

}  // namespace executor_tests

MAUVE_PLUGINS(registry) {
  using namespace executor_tests;
  const std::string shell = "executor_tests/CounterShell";
  registry.type<Number>();
  registry.type<Point>();
  registry.type<Private>();
  registry.type<Attitude>();
  registry.type<Owning>();
  registry.type<JointState>();
  const std::string joints = "executor_tests/JointShell";
  registry.shell<JointShell>(joints);
  registry.core<JointTurner>("executor_tests/JointTurner", joints);
  registry.core<JointKeeper>("executor_tests/JointKeeper", joints);
  registry.fsm<JointFsm>("executor_tests/JointFsm", joints);
  registry.shell<CounterShell>(shell);
  registry.shell<OtherShell>("executor_tests/OtherShell");
  registry.core<Counter>("executor_tests/Counter", shell);
  registry.core<Backwards>("executor_tests/Backwards", shell);
  registry.core<Undeclared>("executor_tests/Undeclared", shell);
  registry.core<Reluctant>("executor_tests/Reluctant", shell);
  registry.core<Unready>("executor_tests/Unready", shell);
  registry.core<Unspeakable>("executor_tests/Unspeakable", shell);
  registry.resource<UnspeakableResource>("executor_tests/UnspeakableResource");
  registry.core<Wasteful>("executor_tests/Wasteful", shell);
  registry.core<Held>("executor_tests/Held", shell);
  registry.core<Slow>("executor_tests/Slow", shell);
  registry.core<Spinning>("executor_tests/Spinning", shell);
  const std::string locking = "executor_tests/LockingShell";
  registry.shell<LockingShell>(locking);
  registry.core<Locking>("executor_tests/Locking", locking);
  registry.fsm<LockingFsm>("executor_tests/LockingFsm", locking);
  registry.resource<Vault>("executor_tests/Vault");
  registry.core<Hanging>("executor_tests/Hanging", shell);
  registry.core<Patient>("executor_tests/Patient", shell);
  registry.core<Clinging>("executor_tests/Clinging", shell);
  const std::string timed = "executor_tests/TimedShell";
  registry.shell<TimedShell>(timed);
  registry.core<Timed>("executor_tests/Timed", timed,
                       {.wcet_ns = {{"act", mauve::us_to_ns(200)}, {"is_enabled", mauve::us_to_ns(1)}}});
  registry.core<Timed>("executor_tests/HalfTimed", timed, {.wcet_ns = {{"act", mauve::us_to_ns(300)}}});
  registry.fsm<TimedFsm>("executor_tests/TimedFsm", timed);
  registry.fsm<CounterFsm>("executor_tests/CounterFsm", shell);
  registry.fsm<GuardedFsm>("executor_tests/GuardedFsm", shell);
  registry.fsm<LoopFsm>("executor_tests/LoopFsm", shell);
  registry.fsm<CalmFsm>("executor_tests/CalmFsm", shell);
  registry.fsm<EventFsm>("executor_tests/EventFsm", shell);
  registry.call_type<SetBool>();
  registry.call_type<Stop>();
  registry.action_type<DriveTo>();
  const std::string driver = "executor_tests/DriverShell";
  registry.shell<DriverShell>(driver);
  registry.core<Driver>("executor_tests/Driver", driver);
  registry.core<Asleep>("executor_tests/Asleep", driver);
  registry.fsm<DriverFsmOf<Driver>>("executor_tests/DriverFsm", driver);
  registry.fsm<DriverFsmOf<Asleep>>("executor_tests/AsleepFsm", driver);
  const std::string passenger = "executor_tests/PassengerShell";
  registry.shell<PassengerShell>(passenger);
  registry.core<Passenger>("executor_tests/Passenger", passenger);
  registry.fsm<PassengerFsm>("executor_tests/PassengerFsm", passenger);
  const std::string stopper = "executor_tests/StopperShell";
  registry.shell<StopperShell>(stopper);
  registry.core<Stopper>("executor_tests/Stopper", stopper);
  registry.fsm<StopperFsm>("executor_tests/StopperFsm", stopper);
  registry.resource<Lamp>("executor_tests/Lamp");
  registry.resource<Window>("executor_tests/Window");
  const std::string caller = "executor_tests/CallerShell";
  registry.shell<CallerShell>(caller);
  registry.core<Caller>("executor_tests/Caller", caller);
  registry.fsm<CallerFsm>("executor_tests/CallerFsm", caller);
  const std::string twin = "executor_tests/TwinShell";
  registry.shell<TwinShell>(twin);
  registry.core<Twin>("executor_tests/Twin", twin);
  registry.fsm<TwinFsm>("executor_tests/TwinFsm", twin);
  const std::string pilot = "executor_tests/PilotShell";
  registry.shell<PilotShell>(pilot);
  registry.core<Pilot>("executor_tests/Pilot", pilot);
  registry.fsm<PilotFsm>("executor_tests/PilotFsm", pilot);
}

// SPDX-License-Identifier: LGPL-3.0-or-later
// A resource of the user's own: a map, looked at and changed by callables; no lock leaves it.
#include <map>

#include "fixtures.hpp"

namespace mauve::testing::test_user_resource {

using Cells = std::map<int, double>;
using CellReader = FunctionRef<void(const Cells&)>;
using CellWriter = FunctionRef<void(Cells&)>;

class CellMap final : public Resource {
 public:
  CellMap() : Resource("test/CellMap", "") {
    offer(get);
    offer(update);
  }
  bool refuses{false};

 private:
  bool configure_hook() override { return !refuses; }

  class Get final : public CallService<void(CellReader)> {
   public:
    explicit Get(CellMap& owner) : CallService("get", "test/CellReader"), owner_(owner) {}
    void call(CellReader read) override {
      const std::lock_guard lock(owner_.mutex_);
      read(owner_.cells_);
    }

   private:
    CellMap& owner_;
  };
  class Update final : public CallService<void(CellWriter)> {
   public:
    explicit Update(CellMap& owner) : CallService("update", "test/CellWriter"), owner_(owner) {}
    void call(CellWriter write) override {
      {
        const std::lock_guard lock(owner_.mutex_);
        write(owner_.cells_);
      }
      owner_.written(monotonic_now_ns());
    }

   private:
    CellMap& owner_;
  };

  PiMutex mutex_;
  Cells cells_;

 public:
  Get get{*this};
  Update update{*this};
};

struct MapShell : Shell {
  CallPort<void(CellReader)>& get = call_port<void(CellReader)>("get", "test/CellReader");
  CallPort<void(CellWriter)>& update = call_port<void(CellWriter)>("update", "test/CellWriter");
};

TEST(UserResource, IsReachedByCallablesAndTellsListeners) {
  struct Counts final : EventListener {
    void on_event(time_ns_t) noexcept override { ++calls; }
    int calls{0};
  };
  CellMap map;
  MapShell shell;
  Counts counts;
  map.listen(counts);
  shell.get.connect(map.get, "map");
  shell.update.connect(map.update, "map");
  EXPECT_EQ(&map, shell.get.service()->resource());
  for (int i = 0; i < 3; ++i) shell.update([i](Cells& cells) { cells[i] = i / 2.0; });
  double sum = 0.0;
  shell.get([&](const Cells& cells) {
    for (const auto& [key, value] : cells) sum += value;
  });
  EXPECT_EQ(1.5, sum);
  EXPECT_EQ(3, counts.calls);
  EXPECT_EQ(0, PiMutex::held_by_this_thread());
}

TEST(UserResource, AThrowingCallableLeavesNoLockBehind) {
  CellMap map;
  MapShell shell;
  shell.update.connect(map.update, "map");
  EXPECT_THROW(shell.update([](Cells&) { throw std::runtime_error("no"); }), std::runtime_error);
  EXPECT_EQ(0, PiMutex::held_by_this_thread());
  shell.update([](Cells& cells) { cells[1] = 1.0; });
}

TEST(UserResource, IsPartOfAnArchitectureByItsPlugInName) {
  PluginRegistry registry;
  registry.resource<CellMap>("test/CellMap");
  registry.shell<MapShell>("test/MapShell");
  Architecture architecture(&registry);
  architecture.add_resource("map", registry.make_resource("test/CellMap", "", {}));
  EXPECT_THAT(registry.names("resource"),
              ::testing::ElementsAre("event", "latest_value", "ring_buffer", "shared_data", "test/CellMap",
                                     "transform_tree"));
  architecture.configure();
  EXPECT_TRUE(architecture.resource("map").is_configured());
  EXPECT_THROW(architecture.publish("map"), Error);

  Architecture refused;
  refused.add_resource<CellMap>("map").refuses = true;
  EXPECT_THROW(refused.configure(), Error);
}

/// What ports exchange in a deployed architecture: the calls of a service are in the trace by name.
TEST_F(Deployed, EachCallIsTracedByResourceAndService) {
  auto& map = architecture.add_resource<CellMap>("map");
  Component& component = add("c", 1);
  CallPort<void(CellWriter)> update("update", "test/CellWriter");
  update.connect(map.update, "map");
  core(component).work = [&] { update([](Cells& cells) { cells[0] += 1.0; }); };
  deploy();
  wait_runs(component, 5);
  deployer.shutdown();
  const std::vector<TraceRecord> begins = records_of(deployer.drain_trace(), TraceKind::service_begin);
  ASSERT_GE(begins.size(), 5U);
  EXPECT_EQ("map.update", TraceNames::all()[begins[0].name]);
}

class Window final : public Resource {
 public:
  static std::vector<ResourceParameter> parameters() {
    return {{.name = "length", .initial = std::int64_t{4}, .unit = "samples", .minimum = 1, .maximum = 9},
            {.name = "gain", .initial = 1.0, .is_required = true}};
  }
  explicit Window(const ResourceParameters& given)
      : Resource("test/Window", ""),
        length(get<std::int64_t>(given, "length")),
        gain(get<double>(given, "gain")) {}
  const std::int64_t length;
  const double gain;
};

TEST(UserResource, IsMadeOfParametersThatWereChecked) {
  PluginRegistry registry;
  registry.resource<Window>("test/Window");
  const auto refusal = [&](const ResourceParameters& given) {
    try {
      registry.make_resource("test/Window", "", given);
    } catch (const Error& error) {
      return std::pair(error.code(), error.detail().element);
    }
    return std::pair(ErrorCode::internal, std::string());
  };
  const auto made = registry.make_resource("test/Window", "", {{"gain", 2}});
  const auto& window = dynamic_cast<const Window&>(*made);
  EXPECT_EQ(4, window.length);
  EXPECT_EQ(2.0, window.gain);
  EXPECT_EQ(std::pair(ErrorCode::invalid_argument, std::string("gain")), refusal({{"length", 5}}));
  EXPECT_EQ(std::pair(ErrorCode::out_of_range, std::string("length")),
            refusal({{"gain", 2}, {"length", 10}}));
  EXPECT_EQ(std::pair(ErrorCode::type_mismatch, std::string("gain")), refusal({{"gain", true}}));
  EXPECT_EQ(std::pair(ErrorCode::invalid_argument, std::string("width")),
            refusal({{"gain", 2}, {"width", 1}}));
  EXPECT_EQ(Window::parameters(), registry.resource_kind("test/Window").parameters);
  EXPECT_THROW(
      registry.add_resource({.name = "test/Bad", .parameters = {{.name = "type", .initial = false}}}, {}),
      Error);
}

}  // namespace mauve::testing::test_user_resource

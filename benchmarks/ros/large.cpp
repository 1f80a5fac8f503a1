// SPDX-License-Identifier: LGPL-3.0-or-later
// A plug-in for benchmarks: components that send and take large messages.
#include "ros/large.hpp"

#include "mauve_rt/mauve_rt.hpp"

#include "mauve_types/sensor_msgs/msg/image.hpp"
#include "mauve_types/sensor_msgs/msg/point_cloud2.hpp"

namespace bench {

using mauve::msg::sensor_msgs::Image;
using mauve::msg::sensor_msgs::PointCloud2;

template <typename T>
inline constexpr std::size_t kContents = std::is_same_v<T, Image> ? kImageBytes : kCloudBytes;

template <typename T>
struct SenderShell : mauve::Shell {
  mauve::WritePort<T>& output = write_port<T>("output");
  mauve::Property<std::int64_t>& period_us =
      property("period_us", 10'000, {.minimum = 1'000, .structural = mauve::ReadBy::fsm});
};

template <typename T>
struct Sender : mauve::Core<SenderShell<T>> {
  void send() {
    this->shell().output.write_with([&](T& message) {
      message.data.resize(kContents<T>);
      fill(message.header.stamp, message.data.data(), message.data.size(), ++pattern_);
    });
  }

 private:
  std::uint8_t pattern_{0};
};

template <typename T>
struct SenderFsm : mauve::PeriodicFsm<SenderShell<T>, Sender<T>> {
  void define() override {
    this->period(mauve::us_to_ns(this->shell().period_us));
    this->set_initial(this->periodic_state("Send", "send", &Sender<T>::send));
  }
};

template <typename T>
struct TakerShell : mauve::Shell {
  mauve::ReadPort<T>& input = read_port<T>("input");
  mauve::Property<std::string>& file = property("file", "", {.description = "gets the arrivals at the end"});
};

template <typename T>
struct Taker : mauve::Core<TakerShell<T>> {
  void take() {
    this->shell().input.with([&](const T& message) {
      if (this->shell().input.status() != mauve::DataStatus::new_data) return;
      arrivals_.add(message.header.stamp, message.data.data(), message.data.size(), kContents<T>);
    });
  }

 protected:
  void cleanup_hook() override { arrivals_.write(this->shell().file.value()); }

 private:
  Arrivals arrivals_;
};

template <typename T>
struct TakerFsm : mauve::Fsm<TakerShell<T>, Taker<T>> {
  void define() override {
    mauve::State& take = this->execution("Take", "take", &Taker<T>::take);
    mauve::State& await =
        this->wait_event("Await", this->shell().input, mauve::s_to_ns(1), mauve::us_to_ns(100));
    this->set_initial(await);
    this->next(await, take);
    this->next(take, await);
  }
};

template <typename T>
void register_large(mauve::PluginRegistry& registry, const std::string& name) {
  registry.type<T>();
  registry.shell<SenderShell<T>>(name + "SenderShell");
  registry.core<Sender<T>>(name + "Sender", name + "SenderShell");
  registry.fsm<SenderFsm<T>>(name + "SenderFsm", name + "SenderShell");
  registry.shell<TakerShell<T>>(name + "TakerShell");
  registry.core<Taker<T>>(name + "Taker", name + "TakerShell");
  registry.fsm<TakerFsm<T>>(name + "TakerFsm", name + "TakerShell");
}

}  // namespace bench

MAUVE_PLUGINS(registry) {
  bench::register_large<bench::Image>(registry, "bench_large/Image");
  bench::register_large<bench::PointCloud2>(registry, "bench_large/Cloud");
}

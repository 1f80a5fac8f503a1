// SPDX-License-Identifier: LGPL-3.0-or-later
// The robot's own map as a resource: looked at and changed in place by callables, never copied through ports.
#pragma once

#include <mutex>

#include "mauve_rt/mauve_rt.hpp"

#include "mauve_examples/occupancy_grid.hpp"

namespace mauve_examples {

using MapReader = mauve::FunctionRef<void(const OccupancyGrid&)>;
using MapWriter = mauve::FunctionRef<void(OccupancyGrid&)>;

inline constexpr const char* kMapReaderType = "mauve_examples/MapReader";
inline constexpr const char* kMapWriterType = "mauve_examples/MapWriter";

/// An occupancy grid with services get and update. Each calls the callable under a priority-inheritance lock:
/// what it does must be short, for the highest of the components that share the map waits for it.
///
/// | member | written by     | under  | hot |
/// |--------|----------------|--------|-----|
/// | grid_  | update service | mutex_ | yes |
class OccupancyMap final : public mauve::Resource {
 public:
  OccupancyMap() : Resource("mauve_examples/OccupancyMap", "") {
    offer(get);
    offer(update);
  }
  void set_name(const std::string& name) override {
    Resource::set_name(name);
    mutex_.set_trace_id(mauve::TraceNames::intern(name));
  }

 private:
  class Get final : public mauve::CallService<void(MapReader)> {
   public:
    explicit Get(OccupancyMap& owner) : CallService("get", kMapReaderType), owner_(owner) {}
    void call(MapReader read) override {
      const std::lock_guard lock(owner_.mutex_);
      read(owner_.grid_);
    }

   private:
    OccupancyMap& owner_;
  };
  class Update final : public mauve::CallService<void(MapWriter)> {
   public:
    explicit Update(OccupancyMap& owner) : CallService("update", kMapWriterType), owner_(owner) {}
    void call(MapWriter write) override {
      const std::lock_guard lock(owner_.mutex_);
      write(owner_.grid_);
    }

   private:
    OccupancyMap& owner_;
  };

  mauve::PiMutex mutex_;
  OccupancyGrid grid_;

 public:
  Get get{*this};
  Update update{*this};
};

}  // namespace mauve_examples

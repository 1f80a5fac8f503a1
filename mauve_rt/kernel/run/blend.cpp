// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/blend.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "mauve_rt/data/port_base.hpp"
#include "mauve_rt/data/port_tap.hpp"
#include "mauve_rt/data/transform.hpp"

namespace mauve {

/// What can be between two values.
struct BlendedPlaces {
  using Turn = std::array<NumberPlace, 4>;  // x, y, z, w
  std::vector<NumberPlace> numbers{};
  std::vector<Turn> turns{};
};

namespace {

using Turn = BlendedPlaces::Turn;

/// Along with those of its fields; `before`: its path, and a dot.
void add_places(const PortBase& port, const std::vector<FieldShape>& fields, const std::string& before,
                BlendedPlaces& places);

void add_message(const PortBase& port, std::string_view type, const std::vector<FieldShape>& fields,
                 const std::string& before, BlendedPlaces& places) {
  if (type != TypeTraits<Quaternion>::name) return add_places(port, fields, before, places);
  Turn turn;
  for (std::size_t i = 0; i < turn.size(); ++i) {
    const std::optional<NumberPlace> place = port.find_number(before + std::string(1, "xyzw"[i]));
    if (!place || place->store == nullptr) return;
    turn[i] = *place;
  }
  places.turns.push_back(turn);
}

void add_places(const PortBase& port, const std::vector<FieldShape>& fields, const std::string& before,
                BlendedPlaces& places) {
  for (const FieldShape& field : fields) {
    if (field.arity == FieldArity::bounded || field.arity == FieldArity::sequence)
      continue;  // at no fixed place
    const bool is_array = field.arity == FieldArity::fixed;
    for (std::size_t index = 0; index < (is_array ? field.size : 1); ++index) {
      const std::string path = before + field.name + (is_array ? "[" + std::to_string(index) + "]" : "");
      if (!field.fields.empty()) {
        add_message(port, field.type, field.fields, path + ".", places);
      } else if (field.type == "float64" || field.type == "float32") {
        if (const std::optional<NumberPlace> place = port.find_number(path)) places.numbers.push_back(*place);
      }
    }
  }
}

Quaternion turn_of(const Turn& turn, const void* value) noexcept {
  return {.x = turn[0].of(value), .y = turn[1].of(value), .z = turn[2].of(value), .w = turn[3].of(value)};
}

}  // namespace

/// The held value of one port.
class Blend::Output final : public PortTap {
 public:
  Output(PortBase& its_port, std::size_t its_place, BlendedPlaces places, std::size_t bytes)
      : port(its_port), place(its_place), places_(std::move(places)), old_(bytes), fresh_(bytes) {}

  void on_read(const void* /*value*/, DataStatus /*status*/, time_ns_t /*time_ns*/) noexcept override {}
  void on_write(const void* value) noexcept override {
    std::memcpy(fresh_.data(), value, fresh_.size());
    is_held_ = true;
  }
  void note_old(const void* value) noexcept {
    std::memcpy(old_.data(), value, old_.size());
    has_old_ = true;
  }
  void write(double weight) noexcept {
    if (!is_held_) return;
    is_held_ = false;
    if (has_old_ && weight < 1.0) mix(weight);
    port.write_held(fresh_.data());
  }
  void drop() noexcept { is_held_ = false; }

  PortBase& port;
  const std::size_t place;

 private:
  /// A number that is no finite one in both is the new core's, as is a turn that is none.
  void mix(double weight) noexcept {
    for (const NumberPlace& number : places_.numbers) {
      const double old = number.of(old_.data()), fresh = number.of(fresh_.data());
      const double between = old + weight * (fresh - old);
      if (std::isfinite(between)) number.set(fresh_.data(), between, old);
    }
    for (const Turn& turn : places_.turns) {
      const Transform old{.rotation = turn_of(turn, old_.data())};
      const Transform fresh{.rotation = turn_of(turn, fresh_.data())};
      const Transform between = interpolate(old, fresh, weight);
      if (!is_finite(between)) continue;  // one of both has length 0, or is not finite
      const auto& [x, y, z, w] = between.rotation;
      turn[0].set(fresh_.data(), x, 0.0);
      turn[1].set(fresh_.data(), y, 0.0);
      turn[2].set(fresh_.data(), z, 0.0);
      turn[3].set(fresh_.data(), w, 0.0);
    }
  }

  const BlendedPlaces places_;
  std::vector<std::byte> old_;
  std::vector<std::byte> fresh_;
  bool has_old_{false};
  bool is_held_{false};
};

Blend::Blend(const Shell& shell, time_ns_t duration_ns) : duration_ns_(duration_ns) {
  const auto& ports = shell.ports();
  for (std::size_t place = 0; place < ports.size(); ++place) {
    PortBase& port = *ports[place];
    if (port.kind() != PortKind::write) continue;
    const std::unique_ptr<PortCell> cell = port.make_cell();
    BlendedPlaces places;
    for (const MessageShape& message : port.messages())
      add_message(port, message.type, message.fields, "", places);
    if (cell == nullptr || (places.numbers.empty() && places.turns.empty())) continue;
    outputs_.push_back(std::make_unique<Output>(port, place, std::move(places), cell->bytes()));
  }
}

Blend::~Blend() { end(); }

void Blend::begin(time_ns_t instant_ns) noexcept {
  begin_ns_ = instant_ns;
  for (const auto& output : outputs_) output->port.hold(*output);
}

double Blend::weight(time_ns_t instant_ns) const noexcept {
  return std::clamp(static_cast<double>(instant_ns - begin_ns_) / static_cast<double>(duration_ns_), 0.0,
                    1.0);
}

void Blend::note_old(std::size_t port, const void* value) noexcept {
  if (value == nullptr) return;
  for (const auto& output : outputs_) {
    if (output->place == port) output->note_old(value);
  }
}

void Blend::write(double weight) noexcept {
  for (const auto& output : outputs_) output->write(weight);
}

void Blend::drop() noexcept {
  for (const auto& output : outputs_) output->drop();
}

void Blend::end() noexcept {
  for (const auto& output : outputs_) output->port.unhold(*output);
}

}  // namespace mauve

// SPDX-License-Identifier: LGPL-3.0-or-later
// A core for a shell of another package: where that one's relays a number, it writes twice the number.
#include <mauve_rt/elements/elements.hpp>
#include <mauve_rt/mauve_rt.hpp>

namespace mauve_downstream {

using Number = mauve::types::Float64;

struct Doubler final : mauve::UpdateCore<mauve::RelayShell<Number>> {
  void update() override {
    const auto sample = shell().inputs[0]->read();
    if (sample.is_new()) shell().output.write({.data = 2.0 * sample.value.data});
  }
};

}  // namespace mauve_downstream

MAUVE_PLUGINS(registry) {
  registry.core<mauve_downstream::Doubler>("mauve_downstream/Doubler", "mauve_rt/Float64RelayShell");
}

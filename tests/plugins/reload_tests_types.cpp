// SPDX-License-Identifier: LGPL-3.0-or-later
#include "reload_tests.hpp"

void reload_tests::register_types(mauve::PluginRegistry& registry) {
  registry.type<Sum>();
  registry.type<Number>();
}

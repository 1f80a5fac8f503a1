// SPDX-License-Identifier: LGPL-3.0-or-later
// The folder of the examples' sources. Only this file is compiled anew in each clone: paths that ccache compares between
// clones, __FILE__ among them, are relative to the build.
#include "test_maps.hpp"

std::filesystem::path mauve_examples::testing::source_folder() { return MAUVE_EXAMPLES_FOLDER; }

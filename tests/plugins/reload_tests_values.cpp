// SPDX-License-Identifier: LGPL-3.0-or-later
// What differs in most variants: without the kernel's headers, so that it compiles at once.
#include <cstdlib>

#ifndef STEP
#define STEP 1.0
#endif
#ifndef GAIN
#define GAIN 1.0
#endif

namespace reload_tests {

double first_step() { return STEP; }
double first_gain() { return GAIN; }

#ifdef CRASH
const int crash = [] {
  std::abort();
  return 0;
}();
#endif
#ifdef HANG
const int hang = [] {
  for (volatile bool goes_on = true; goes_on;) {
  }
  return 0;
}();
#endif
#ifdef MISSING
int missing();
const int used = missing();
#endif

}  // namespace reload_tests

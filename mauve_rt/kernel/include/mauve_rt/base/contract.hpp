// SPDX-License-Identifier: LGPL-3.0-or-later
// Contracts in code: MAUVE_EXPECTS, MAUVE_ENSURES and MAUVE_AUDIT.
#pragma once

#include "mauve_rt/base/rt.hpp"

/// A contract is a condition that only a defect breaks: never a wrong input, a late thread or a refusal of the system.
///
///     MAUVE_EXPECTS(task != nullptr);  // a precondition
///     MAUVE_ENSURES(clock >= before);  // a postcondition, or an invariant
///     MAUVE_AUDIT(is_sorted(queue));   // the same where the check costs more than a compare
///
/// | macro                        | compiled into                                        | cost                       |
/// | ---------------------------- | ---------------------------------------------------- | -------------------------- |
/// | MAUVE_EXPECTS, MAUVE_ENSURES | every build                                          | a compare of what is known |
/// | MAUVE_AUDIT                  | sanitizer builds, and builds with -DMAUVE_AUDITS=ON  | none elsewhere             |
///
/// While the condition holds all three are [rt]. A broken contract writes file, line and condition to stderr, then throws Error
/// (internal) with the same text:
///
/// | where it breaks                                      | what follows                                            |
/// | ---------------------------------------------------- | ------------------------------------------------------- |
/// | in a state or a guard of a component                 | the component is FAULTED with that text; others run on  |
/// | in a function that may throw, on an ordinary thread  | the caller receives the Error                           |
/// | in a noexcept function, or one that is MAUVE_RT      | the process aborts: there is no state to go on from     |
///
/// So a noexcept function has a contract only where to go on would do more harm than to end: a lost wake-up, a freed part in
/// use, an output written by two. The condition has no side effects.
#define MAUVE_EXPECTS(...) MAUVE_CONTRACT_("precondition", __VA_ARGS__)
#define MAUVE_ENSURES(...) MAUVE_CONTRACT_("postcondition", __VA_ARGS__)

#ifdef MAUVE_AUDITS
#define MAUVE_AUDIT(...) MAUVE_CONTRACT_("audit", __VA_ARGS__)
#else
#define MAUVE_AUDIT(...) \
  static_cast<void>(sizeof(static_cast<bool>(__VA_ARGS__)))  // compiled, never evaluated
#endif

#define MAUVE_CONTRACT_(kind, ...)                        \
  (__builtin_expect(static_cast<bool>(__VA_ARGS__), true) \
       ? static_cast<void>(0)                             \
       : MAUVE_RT_TRUSTED(::mauve::detail::break_contract({kind, #__VA_ARGS__, __FILE_NAME__, __LINE__})))

namespace mauve::detail {

/// Constants alone, so that the place of a contract passes one address.
struct Contract {
  const char* kind;
  const char* condition;
  const char* file;
  int line;
};

/// Reports the broken contract. [non-rt] Throws Error (internal).
[[noreturn, gnu::cold, gnu::noinline]] void break_contract(const Contract& contract);

}  // namespace mauve::detail

// SPDX-License-Identifier: LGPL-3.0-or-later
// MAUVE_RT: what the tag [rt] promises, in the declaration, where compilers can check it.
#pragma once

/// Tags that close the first doc line of every public function:
///   [rt]      bounded, no allocation, no system call but a futex or a membarrier; may be called on a component thread; throws nothing
///   [non-rt]  any thread but a component thread
///   [setup]   only before the component is started
/// "[rt] as far as the core is": so is the function itself, but it runs code of others, which may throw.
///
/// MAUVE_RT stands where noexcept does in the declaration of each [rt] function: void write(int value) MAUVE_RT;
/// Clang from 20 on checks with -Wfunction-effects that such a function calls only such functions, and with
/// -fsanitize=realtime, while it runs, that it does nothing which could block. The functions of a core may carry it too.
#if defined(__clang__)
#if __has_cpp_attribute(clang::nonblocking) && __has_warning("-Wfunction-effects")
#define MAUVE_RT noexcept [[clang::nonblocking]]
#if __has_feature(realtime_sanitizer)
#define MAUVE_RT_TRUSTED_HERE ::mauve::detail::TrustedHere(),
#else
#define MAUVE_RT_TRUSTED_HERE
#endif
#define MAUVE_RT_TRUSTED(...)                                                                       \
  _Pragma("clang diagnostic push")                                                                  \
      _Pragma("clang diagnostic ignored \"-Wfunction-effects\"")(MAUVE_RT_TRUSTED_HERE __VA_ARGS__) \
          _Pragma("clang diagnostic pop")
#endif
#endif

#ifndef MAUVE_RT
#define MAUVE_RT noexcept
/// An expression that is [rt] though no compiler can see it, as a call of the system that is bounded. Each of them has its
/// reason beside it.
#define MAUVE_RT_TRUSTED(...) (__VA_ARGS__)
#endif

#ifdef MAUVE_RT_TRUSTED_HERE
#if __has_feature(realtime_sanitizer)
namespace mauve::detail {

extern "C" void __rtsan_disable();
extern "C" void __rtsan_enable();

/// Until its end the sanitizer does not look at the calling thread.
struct TrustedHere {
  TrustedHere() noexcept { __rtsan_disable(); }
  ~TrustedHere() { __rtsan_enable(); }
};

}  // namespace mauve::detail
#endif
#endif

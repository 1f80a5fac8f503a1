// SPDX-License-Identifier: LGPL-3.0-or-later
// The two halves of an asymmetric memory barrier: one costs nothing, the other one interrupts every thread of the process.
#pragma once

#include <atomic>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

/// Keeps the compiler from moving memory accesses across. With process_barrier() on the other side it is a full barrier. [rt]
inline void light_barrier() MAUVE_RT { std::atomic_signal_fence(std::memory_order_seq_cst); }

/// Every thread of the process runs a full barrier before this returns: membarrier(2), private and expedited. [rt] Some
/// microseconds: the CPUs that run threads of the process are interrupted. Only where has_process_barrier().
void process_barrier() MAUVE_RT;

/// Whether the system has it: Linux from 4.14 on, unless a sandbox refuses it. [rt]
bool has_process_barrier() MAUVE_RT;

}  // namespace mauve

// SPDX-License-Identifier: LGPL-3.0-or-later
// Which lock guards a member, or must be held for a call, in the declaration: clang's -Wthread-safety checks it.
#pragma once

#if defined(__clang__)
#define MAUVE_THREAD_SAFETY(attribute) __attribute__((attribute))
#else
#define MAUVE_THREAD_SAFETY(attribute)
#endif

/// A class of locks; of guards, which hold a lock for as long as they live.
#define MAUVE_LOCK MAUVE_THREAD_SAFETY(capability("mutex"))
#define MAUVE_GUARD MAUVE_THREAD_SAFETY(scoped_lockable)
/// The member is read and written under that lock.
#define MAUVE_GUARDED_BY(lock) MAUVE_THREAD_SAFETY(guarded_by(lock))
/// The caller holds these locks.
#define MAUVE_REQUIRES(...) MAUVE_THREAD_SAFETY(requires_capability(__VA_ARGS__))
/// The function locks, or unlocks: these locks, or its object.
#define MAUVE_ACQUIRE(...) MAUVE_THREAD_SAFETY(acquire_capability(__VA_ARGS__))
#define MAUVE_ACQUIRE_SHARED(...) MAUVE_THREAD_SAFETY(acquire_shared_capability(__VA_ARGS__))
#define MAUVE_TRY_ACQUIRE(...) MAUVE_THREAD_SAFETY(try_acquire_capability(__VA_ARGS__))
#define MAUVE_TRY_ACQUIRE_SHARED(...) MAUVE_THREAD_SAFETY(try_acquire_shared_capability(__VA_ARGS__))
#define MAUVE_RELEASE(...) MAUVE_THREAD_SAFETY(release_capability(__VA_ARGS__))
#define MAUVE_RELEASE_SHARED(...) MAUVE_THREAD_SAFETY(release_shared_capability(__VA_ARGS__))
/// The function hands out that lock.
#define MAUVE_RETURNS_LOCK(lock) MAUVE_THREAD_SAFETY(lock_returned(lock))
/// The function holds its locks in a way that the compiler does not understand. Each has its reason beside it.
#define MAUVE_LOCKS_UNSEEN MAUVE_THREAD_SAFETY(no_thread_safety_analysis)

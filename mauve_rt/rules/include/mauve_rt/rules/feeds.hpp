// SPDX-License-Identifier: LGPL-3.0-or-later
// Feeds: what an executor's rules hear, taken where it happens.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/rules/signal.hpp"

namespace mauve::rules {

/// Tells one signal what happens to one thing of an architecture.
class Feed {
 public:
  Feed() = default;
  virtual ~Feed() = default;
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  /// The architecture has changed: what it listens to may be gone, or there anew. [non-rt], one thread
  virtual void follow() = 0;
};

class ComponentFeed;

/// Where feeds find what they listen to; outlives them.
struct FeedPlace {
  Architecture& architecture;
  const Clock& clock;                           // the receiver's own
  std::map<std::string, std::string> topics{};  // topic -> the resource that is bound to it
};

/// The feeds of an engine's signals.
class Feeds {
 public:
  explicit Feeds(FeedPlace place);
  ~Feeds();
  Feeds(const Feeds&) = delete;
  Feeds& operator=(const Feeds&) = delete;

  /// Lets the signal hear what it is declared to hear, from now on. [setup]
  /// Throws Error: that is not there, or cannot be heard in an executor.
  void open(const SignalSpec& spec, Signal& signal);
  /// The signal hears nothing any more afterwards. [non-rt]
  void close(const Signal& signal);
  /// From now on these topics are meant. [non-rt]
  void set_topics(std::map<std::string, std::string> topics) { place_.topics = std::move(topics); }
  /// As Feed's, of all of them. [non-rt], one thread
  void follow();
  /// The executor's Python side works. [rt], one thread
  void beat() MAUVE_RT;

 private:
  void open_component(const SignalSpec& spec, Signal& signal);
  const std::string& resource_of(const std::string& topic) const;

  FeedPlace place_;
  std::map<const Signal*, std::unique_ptr<Feed>> feeds_;  // of a signal each
  std::map<std::string, std::unique_ptr<ComponentFeed>> components_;
  std::vector<Signal*> node_;
};

}  // namespace mauve::rules

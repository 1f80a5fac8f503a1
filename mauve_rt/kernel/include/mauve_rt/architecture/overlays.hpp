// SPDX-License-Identifier: LGPL-3.0-or-later
// Overlays: what each element of an architecture should be, and who wants it so.
#pragma once

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mauve_rt/architecture/authors.hpp"
#include "mauve_rt/architecture/description.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/value.hpp"

namespace mauve {

/// What a step sets, in names and plain values, so that it can be made again and again.
struct Assignment {
  std::string kind{};  // as Transaction::add() takes it
  std::string target{};
  std::string name{};
  std::optional<PropertyValue> value{};

  bool operator==(const Assignment&) const = default;
};

/// One thing that a step can set, as in Authored: the core of a component, a property, whether it runs ...
struct Element {
  std::string target{};
  std::string name{};

  auto operator<=>(const Element&) const = default;
};

/// How the author of what a rule did begins: Authored::author.
inline constexpr std::string_view kByRule = "rule ";
/// Sources of overlays that an executor found at its start: of rules that its rules file lacks ...
inline constexpr std::string_view kKept = "(kept)";
/// ... and of components that stay stopped, as it cannot know or do what a rule wants of them.
inline constexpr std::string_view kHeldStopped = "(held stopped)";

/// An assignment and the element that it sets; no target: it sets none (resynchronise).
struct Assigned {
  Element element{};
  Assignment step{};

  bool operator==(const Assigned&) const = default;
};

/// Without the elements. [non-rt]
std::vector<Assignment> steps_of(const std::vector<Assigned>& all);
/// Whether both leave the element the same. A core on probation is the same core. [non-rt]
bool is_same_effect(const Assignment& one, const Assignment& other);
/// What an element is, as the step that would make it so; nothing: no step can, or it is not there. [non-rt]
std::optional<Assignment> present(const ArchitectureDescription& description, const Element& element);

/// What one rule wants while it is active.
struct OverlaySpec {
  std::string rule{};
  std::string source{};  // who runs the rule; empty: the executor itself
  std::int64_t priority{0};
  bool safety{false};            // above all that are not, and above a person's overlay that does not name it
  bool whole{false};             // it contributes nothing while one of its elements is taken
  bool ends_with_source{false};  // it is released when the source is gone
  bool latch{false};             // a person ends it
  std::vector<Assigned> assigns{};  // of several of one element the last one is its value
  std::vector<Assigned>
      leaves{};  // becomes the base at its end, its own value only where that was in force ...
  bool leaves_over_persons{false};  // ... else only where no person gave the element its base

  bool operator==(const OverlaySpec&) const = default;
};

/// A base that a person chose, and what the architecture file said of the element then.
struct KeptBase {
  Assigned assigned{};
  std::string author{};
  std::optional<Assignment> of_file{};

  bool operator==(const KeptBase&) const = default;
};

/// What outlasts the process.
struct KeptState {
  std::vector<OverlaySpec> active{};  // of latched rules
  std::vector<Assigned> rejected{};
  std::vector<KeptBase> bases{};

  bool operator==(const KeptState&) const = default;
};

enum class Activity : std::uint8_t {
  inactive,
  active,
  ended,  // what it leaves is not in the base yet
};

/// One rule's overlay: its activity, and whether what it wants may be on its way.
///
/// | member     | written by            | read by | order                                                              |
/// | ---------- | --------------------- | ------- | ------------------------------------------------------------------ |
/// | activity_  | who decides; Overlays: ended -> inactive | all | release/acquire: who sees it active sees no base of later |
/// | engaged_   | who decides           | all     | release/acquire: odd before anything is begun, even after it is over and described |
/// | activations_ | who decides         | Overlays | release/acquire: what was in force before it grew is of an earlier activity |
/// | outdated_  | who decides, Overlays | who prepares and who begins | release/acquire: what was found out before it was read may be of yesterday |
/// | word_      | who decides, Overlays | who keeps the state         | release/acquire: who sees it grow sees the activity |
class Overlay {
 public:
  Overlay(OverlaySpec spec, std::shared_ptr<Atomic<std::uint32_t>> word)
      : spec_(std::move(spec)), word_(std::move(word)) {}
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  /// [rt]
  const OverlaySpec& spec() const MAUVE_RT { return spec_; }
  /// [rt]
  bool is_active() const MAUVE_RT { return activity() == Activity::active; }
  /// [rt]
  Activity activity() const MAUVE_RT { return activity_.load(std::memory_order_acquire); }
  /// [rt]
  bool is_engaged() const MAUVE_RT { return (engaged() & 1U) != 0; }
  /// Whether both set one element. [non-rt]
  bool shares_with(const Overlay& other) const;
  /// Whether this one's values come before the other's, where both are active. [rt]
  bool ranks_above(const Overlay& other) const MAUVE_RT;

  // ---- who decides, one thread

  /// [rt]
  void set_active(bool is_active) MAUVE_RT;
  /// Whether something that it wants, or wanted, is on its way or in force. [rt]
  void set_engaged(bool is_engaged) MAUVE_RT;
  /// The steps to what is wanted once it is active, or no longer, may be others. [rt]
  void outdate(bool once_active) MAUVE_RT {
    outdated_[once_active ? 1 : 0].fetch_add(1, std::memory_order_release);
  }
  /// [rt]
  std::uint32_t outdated(bool once_active) const MAUVE_RT {
    return outdated_[once_active ? 1 : 0].load(std::memory_order_acquire);
  }

 private:
  friend class Overlays;

  void go_on_as(const Overlay& other);
  std::uint32_t engaged() const MAUVE_RT { return engaged_.load(std::memory_order_acquire); }
  const Assignment* find(const Element& element) const;
  bool has_given_back(const Element& element) const;
  /// Whether its end leaves its own value: it has no `undo`.
  bool leaves_own(const Assigned& left) const;
  bool was_in_force(const Element& element) const;

  const OverlaySpec spec_;
  const std::shared_ptr<Atomic<std::uint32_t>> word_;  // of the Overlays, which it may outlive
  std::size_t order_{0};  // among those of equal priority; guarded by Overlays::mutex_
  std::vector<Element>
      given_back_{};                 // of the overlay that it takes the place of; guarded by Overlays::mutex_
  std::vector<Element> in_force_{};  // what of it was there; guarded by Overlays::mutex_
  std::uint32_t in_force_since_{0};  // the activation in which; guarded by Overlays::mutex_
  Atomic<Activity> activity_{Activity::inactive};
  Atomic<std::uint32_t> activations_{0};
  Atomic<std::uint32_t> engaged_{0};
  Atomic<std::uint32_t> outdated_[2]{};
};

/// What one element should be.
struct Wanted {
  enum class By : std::uint8_t {
    base,
    rule,
    over,  // what a person put over the rules
    stop,  // a person stopped the component
    none,  // every value was rejected: the component is to stop
  };
  std::optional<Assignment> step{};  // nothing: as it is
  By by{By::base};
  std::string rule{};  // of By::rule
};

/// One element that rules or persons have their hand on.
struct HeldElement {
  Element element{};
  std::optional<Assignment> base{};
  Wanted wanted{};
  std::vector<std::string> rules{};  // active ones that assign it, the highest first
};

/// What is wanted of each element: the value of the highest active rule that assigns it, else its base. Each element by itself.
///
/// The base is what somebody who is no rule gave it last. While no rule has its hand on an element, that is what it is; from then
/// on note() keeps it.
///
/// | member   | written by                       | guarded by |
/// | -------- | -------------------------------- | ---------- |
/// | word_    | who changes what is kept         | release/acquire: who waits reads the rest after it |
/// | the rest | who loads rules, makes changes, requests | mutex_ |
class Overlays {
 public:
  // ---- rules

  /// The rules of a source take the place of those that it had: one of the same name stays active, with what it wants now. The
  /// others are gone: end them first. [non-rt]
  std::vector<std::shared_ptr<Overlay>> load(const std::string& source, std::vector<OverlaySpec> specs);
  /// The same of one rule; the source keeps its others. [non-rt]
  std::shared_ptr<Overlay> put(const std::string& source, OverlaySpec spec);
  /// Those that no thread of their own decides. [non-rt]
  void set_active(const std::shared_ptr<Overlay>& overlay, bool is_active);
  void set_engaged(const std::shared_ptr<Overlay>& overlay, bool is_engaged);
  /// All that are active, the highest first. [non-rt]
  std::vector<std::shared_ptr<Overlay>> active() const;
  /// Those of a source that are active or engaged. [non-rt]
  std::vector<std::shared_ptr<Overlay>> at_work(const std::string& source) const;
  /// [non-rt]
  std::shared_ptr<Overlay> find(const std::string& rule) const;

  /// What is to be done once the rule is active, or no longer is, and nothing else changes; what is so by the description is left
  /// out. [non-rt]
  std::vector<Assignment> steps_if(const Overlay& rule, bool is_active,
                                   const ArchitectureDescription* description) const;
  /// Whether nothing is left to be done for that; nothing: the rule sets no element. [non-rt]
  std::optional<bool> is_so(const Overlay& rule, bool is_active,
                            const ArchitectureDescription& description) const;
  /// Grows with all that may make steps_if() another, but for the rules' own activity. [non-rt]
  std::uint64_t changes() const;
  /// What rules that have ended leave becomes the base. [non-rt]
  void settle_ended();

  // ---- over a restart

  /// Grows with each activity, quarantine and base that changes; a futex. [rt]
  const Atomic<std::uint32_t>& word() const MAUVE_RT { return *word_; }
  /// [rt]
  void bump() MAUVE_RT;
  /// What is to outlast the process. `file`: what the architecture file made. [non-rt]
  KeptState kept(const ArchitectureDescription& file) const;
  /// Puts it in force, of an architecture that does not run. Rules that are not among `rules` are of the source kKept; a base of
  /// which the file has another value by now is left out, and returned. [non-rt]
  std::vector<KeptBase> restore(const KeptState& state, const std::set<std::string>& rules,
                                const ArchitectureDescription& file);
  /// What makes the architecture so, and who wants it; without starts and stops. [non-rt]
  std::vector<std::pair<std::string, Assignment>> restoring_steps(
      const ArchitectureDescription& description) const;
  /// The rule is of that source from now on, as active as it was; false: the other source has no such rule. [non-rt]
  bool move(const std::string& rule, const std::string& from, const std::string& to);

  // ---- following the architecture

  /// Which overlays were engaged at one instant.
  using Look = std::map<const Overlay*, std::uint32_t>;
  /// Before a description is made. [non-rt]
  Look look() const;
  /// Takes what the description shows as the base of elements on which no rule had its hand since the look, and finds which
  /// values of active rules are in force. [non-rt]
  /// `faulted`: cores whose place the fallback has taken, which are rejected.
  void follow(const Look& before, const ArchitectureDescription& description,
              const std::vector<Authored>& authors, const std::vector<Assigned>& faulted);
  /// A change that is in force. Of somebody who is no rule, it is the base. A stop is above all, until a start. [non-rt]
  void note(const Assigned& assigned, const std::string& author);

  // ---- persons

  /// [non-rt]
  Wanted wanted(const Element& element) const;
  /// The rule that keeps a person from this assignment; empty: none. [non-rt]
  std::string holder_against(const Assigned& assigned) const;
  /// A person's value above all rules but safety rules, but for one that is named; until that, or every rule about it, ends. [non-rt]
  void put_over(const Assigned& assigned, const std::string& safety_rule = {});
  /// Ends what a person put over the rule; an empty name: all of it. Which elements those were. [non-rt]
  std::vector<Element> take_off(const std::string& rule = {});
  void take_off(const Element& element);
  /// Ends a person's stop of a component. [non-rt]
  void lift_stop(const std::string& component);
  /// The base changes while a rule has its hand on the element. [non-rt]
  void set_base(const Assigned& assigned, const std::string& author);
  /// At an activation, where persons' stops end. [non-rt]
  void start_all();
  /// Whether a rule keeps the component stopped, or a part of it is in quarantine. [non-rt]
  bool is_kept_stopped(const std::string& component, const ArchitectureDescription& description) const;

  /// The value was rejected, by a probation or a fault: it is in quarantine, and not put in again. [non-rt]
  void reject(const Assigned& assigned);
  /// Ends the quarantine of all values of the element. [non-rt]
  void forgive(const Element& element);
  /// What is in quarantine. [non-rt]
  std::vector<Assigned> rejected() const;

  /// Of what rules or persons have their hand on, sorted. [non-rt]
  std::vector<HeldElement> table() const;

 private:
  struct Base {
    std::optional<Assignment> value{};
    std::string author{};
    std::deque<Assignment> history{};  // those before, the last one first
  };
  struct Over {
    Assignment step{};
    std::string safety_rule{};
  };
  /// What is supposed of one rule.
  struct If {
    const Overlay* rule{nullptr};
    bool is_active{false};
  };

  std::shared_ptr<Overlay> next_of(const std::string& source, OverlaySpec spec) const MAUVE_REQUIRES(mutex_);
  std::vector<const Overlay*> ranked(const If& supposed) const MAUVE_REQUIRES(mutex_);
  bool contributes(const Overlay& whole, const std::vector<const Overlay*>& higher) const
      MAUVE_REQUIRES(mutex_);
  Wanted wanted(const Element& element, const If& supposed) const MAUVE_REQUIRES(mutex_);
  const Overlay* driver(const Element& element, const If& supposed) const MAUVE_REQUIRES(mutex_);
  std::optional<Assignment> base_of(const Element& element, const If& supposed) const MAUVE_REQUIRES(mutex_);
  bool is_rejected(const Element& element, const Assignment& step) const MAUVE_REQUIRES(mutex_);
  void change_base(const Element& element, std::optional<Assignment> step, const std::string& author)
      MAUVE_REQUIRES(mutex_);
  void outdate(const Element& element) MAUVE_REQUIRES(mutex_);
  void note_rejected(const Assigned& assigned) MAUVE_REQUIRES(mutex_);
  void pardon(const Assigned& assigned) MAUVE_REQUIRES(mutex_);
  bool may_leave(const Overlay& rule, const Assigned& left) const MAUVE_REQUIRES(mutex_);
  void base_on(const ArchitectureDescription& file, const Element& element) MAUVE_REQUIRES(mutex_);
  void note_in_force(Overlay& rule, const Assigned& assigned) MAUVE_REQUIRES(mutex_);

  std::vector<Assigned> steps(const Overlay& rule, bool is_active) const MAUVE_REQUIRES(mutex_);
  void enter_wanted(std::vector<Assigned>& found, const Element& element, const std::string& kind,
                    const If& once) const MAUVE_REQUIRES(mutex_);
  bool is_covered(const Element& element) const MAUVE_REQUIRES(mutex_);
  bool is_free(const Element& element, const Look& before) const MAUVE_REQUIRES(mutex_);
  static bool was_free(const Overlay& each, const Look& before);

  const std::shared_ptr<Atomic<std::uint32_t>> word_ = std::make_shared<Atomic<std::uint32_t>>(0U);
  mutable Mutex mutex_;
  std::uint64_t changes_ MAUVE_GUARDED_BY(mutex_){0};
  std::vector<std::shared_ptr<Overlay>> all_ MAUVE_GUARDED_BY(mutex_);
  std::map<Element, Base> bases_ MAUVE_GUARDED_BY(mutex_);
  std::map<Element, Over> over_ MAUVE_GUARDED_BY(mutex_);
  std::set<std::string> stopped_ MAUVE_GUARDED_BY(mutex_);
  std::vector<Assigned> rejected_ MAUVE_GUARDED_BY(mutex_);
  std::vector<Assigned> faulted_ MAUVE_GUARDED_BY(mutex_);  // at the last look
};

}  // namespace mauve

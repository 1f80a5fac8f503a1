// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/overlays.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "mauve_rt/base/seam/futex.hpp"

namespace mauve {

namespace {

constexpr std::size_t kMostHistory = 8;
constexpr std::string_view kState = "state";

std::optional<double> number(const PropertyValue& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  if (const auto* real = std::get_if<double>(&value)) return *real;
  return std::nullopt;
}

bool is_same_value(const PropertyValue& one, const PropertyValue& other) {
  const auto first = number(one);
  const auto second = number(other);
  if (!first || !second) return one == other;
  return std::abs(*first - *second) <= 1e-9 * std::max(std::abs(*first), std::abs(*second));
}

bool is_person(const std::string& author) {
  return !author.empty() && !author.starts_with(kByRule) && author != "probation" && author != "fallback";
}

template <typename Facts>
const Facts* find_named(const std::vector<Facts>& all, std::string_view name) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Facts& one) { return one.name == name; });
  return found != all.end() ? &*found : nullptr;
}

std::optional<Assignment> part(const char* kind, const Element& element, const std::string& implementation) {
  if (implementation.empty()) return std::nullopt;  // an object, which nothing can make again
  return Assignment{.kind = kind, .target = element.target, .name = implementation};
}

std::optional<Assignment> present_property(const ComponentFacts& facts, const Element& element,
                                           const std::string& name) {
  const ShownProperty* const property = find_named(facts.parts.properties, name);
  if (property == nullptr) return std::nullopt;
  return Assignment{.kind = "set_property", .target = element.target, .name = name, .value = property->value};
}

std::optional<Assignment> present_port(const ComponentFacts& facts, const Element& element,
                                       const std::string& name) {
  const ShownPort* const port = find_named(facts.parts.ports, name);
  if (port == nullptr) return std::nullopt;
  if (port->resource.empty()) return Assignment{.kind = "disconnect", .target = element.target, .name = name};
  return Assignment{.kind = "connect",
                    .target = element.target,
                    .name = name,
                    .value = PropertyValue(port->resource + "." + port->service)};
}

std::optional<Assignment> present_of(const ComponentFacts& facts, const Element& element) {
  if (element.name == "core") return part("replace_core", element, facts.parts.core);
  if (element.name == "fsm") return part("replace_fsm", element, facts.parts.fsm);
  if (element.name == "shell") return part("replace_shell", element, facts.parts.shell);
  if (element.name == kState) {
    const bool runs = facts.state == ComponentState::running || facts.state == ComponentState::stopping;
    return Assignment{.kind = runs ? "start" : "stop", .target = element.target};
  }
  const std::size_t space = element.name.find(' ');
  if (space == std::string::npos) return std::nullopt;
  const std::string name = element.name.substr(space + 1);
  return element.name.starts_with("port") ? present_port(facts, element, name)
                                          : present_property(facts, element, name);
}

/// Whether a step puts in another part, with other properties and ports.
bool replaces(const Assignment& step) { return step.kind.starts_with("replace_"); }

/// Whether the same step makes the same again: no object, no candidate of a shadow.
bool is_made_again(const Assignment& step) {
  if (replaces(step)) return !step.name.empty();
  constexpr std::array kKinds{"set_property", "connect", "disconnect", "start", "stop"};
  return std::find(kKinds.begin(), kKinds.end(), step.kind) != kKinds.end();
}

/// Elements that a restart can set again.
bool is_kept_base(const Element& element) {
  constexpr std::array kParts{"core", "fsm", "shell"};
  return std::find(kParts.begin(), kParts.end(), element.name) != kParts.end() ||
         element.name.starts_with("property ") || element.name.starts_with("port ");
}

/// Wakes who waits for another state.
void bump_word(Atomic<std::uint32_t>& word) noexcept {
  word.fetch_add(1, std::memory_order_release);
  futex_wake_all(word);
}

constexpr int kLastPlace = 6;
/// In which order steps are safe whatever they undo: what is added first, what runs and what goes last.
int place_of(const Assignment& step) {
  if (step.kind.starts_with("add_")) return 0;
  if (step.kind == "replace_shell") return 1;
  if (replaces(step)) return 2;
  if (step.kind == "connect" || step.kind == "disconnect") return 3;
  if (step.kind == "set_property") return 4;
  if (step.kind.starts_with("remove_")) return kLastPlace;
  return 5;
}

/// As they are safe whatever they undo.
std::vector<Assigned> in_order(const std::vector<Assigned>& all) {
  std::vector<Assigned> sorted;
  sorted.reserve(all.size());
  for (int place = 0; place <= kLastPlace; ++place) {
    std::copy_if(all.begin(), all.end(), std::back_inserter(sorted),
                 [&](const Assigned& one) { return place_of(one.step) == place; });
  }
  return sorted;
}

/// Those that are not so. A part that is another one has other properties and ports.
std::vector<Assigned> differences(const std::vector<Assigned>& found,
                                  const ArchitectureDescription& description) {
  std::vector<Assigned> left;
  std::set<std::string> replaced;
  for (const Assigned& one : found) {
    const auto now = one.element.target.empty() ? std::nullopt : present(description, one.element);
    const bool is_of_part = one.element.name.find(' ') != std::string::npos;
    const bool is_so = now.has_value() && is_same_effect(*now, one.step) &&
                       !(is_of_part && replaced.contains(one.element.target));
    if (is_so) continue;
    if (replaces(one.step)) replaced.insert(one.element.target);
    left.push_back(one);
  }
  return left;
}

}  // namespace

std::vector<Assignment> steps_of(const std::vector<Assigned>& all) {
  std::vector<Assignment> steps;
  steps.reserve(all.size());
  for (const Assigned& one : all) steps.push_back(one.step);
  return steps;
}

bool is_same_effect(const Assignment& one, const Assignment& other) {
  for (const char* whole : {"add_", "remove_"}) {
    if (one.kind.starts_with(whole)) return other.kind.starts_with(whole) && one.target == other.target;
  }
  if (one.kind != other.kind || one.target != other.target || one.name != other.name) return false;
  if (replaces(one)) return true;
  if (one.value.has_value() != other.value.has_value()) return false;
  return !one.value || is_same_value(*one.value, *other.value);
}

std::optional<Assignment> present(const ArchitectureDescription& description, const Element& element) {
  const ComponentFacts* const facts = find_named(description.components, element.target);
  if (!element.name.empty()) return facts != nullptr ? present_of(*facts, element) : std::nullopt;
  if (facts != nullptr) return Assignment{.kind = "add_component", .target = element.target};
  if (find_named(description.resources, element.target) != nullptr)
    return Assignment{.kind = "add_resource", .target = element.target};
  return Assignment{.kind = "remove_component", .target = element.target};
}

// ---- one overlay

const Assignment* Overlay::find(const Element& element) const {
  const Assignment* found = nullptr;
  for (const Assigned& one : spec_.assigns) {
    if (one.element == element) found = &one.step;
  }
  return found;
}

bool Overlay::has_given_back(const Element& element) const {
  return std::find(given_back_.begin(), given_back_.end(), element) != given_back_.end();
}

bool Overlay::leaves_own(const Assigned& left) const {
  const Assignment* const own = find(left.element);
  return own != nullptr && is_same_effect(*own, left.step);
}

bool Overlay::was_in_force(const Element& element) const {
  return in_force_since_ == activations_.load(std::memory_order_acquire) &&
         std::find(in_force_.begin(), in_force_.end(), element) != in_force_.end();
}

bool Overlay::shares_with(const Overlay& other) const {
  return std::any_of(spec_.assigns.begin(), spec_.assigns.end(), [&](const Assigned& one) {
    return !one.element.target.empty() && other.find(one.element) != nullptr;
  });
}

bool Overlay::ranks_above(const Overlay& other) const noexcept {
  if (spec_.safety != other.spec_.safety) return spec_.safety;
  if (spec_.priority != other.spec_.priority) return spec_.priority > other.spec_.priority;
  return order_ < other.order_;
}

void Overlay::set_active(bool is_active) noexcept {
  const Activity before = activity();
  if ((before == Activity::active) == is_active) return;
  const Activity after = is_active ? Activity::active : Activity::ended;
  if (is_active) activations_.fetch_add(1, std::memory_order_release);
  activity_.store(after, std::memory_order_release);
  bump_word(*word_);
}

/// This one is not in use yet: so relaxed.
void Overlay::go_on_as(const Overlay& other) {
  activity_.store(other.activity(), std::memory_order_relaxed);
  engaged_.store(other.engaged(), std::memory_order_relaxed);
  activations_.store(other.activations_.load(std::memory_order_acquire), std::memory_order_relaxed);
  in_force_ = other.in_force_;
  in_force_since_ = other.in_force_since_;
}

void Overlay::set_engaged(bool is_engaged) noexcept {
  const std::uint32_t before =
      engaged_.load(std::memory_order_relaxed);  // relaxed: this thread alone writes it
  if (((before & 1U) != 0) != is_engaged) engaged_.store(before + 1, std::memory_order_release);
}

// ---- rules

std::vector<std::shared_ptr<Overlay>> Overlays::load(const std::string& source,
                                                     std::vector<OverlaySpec> specs) {
  const LockGuard lock(mutex_);
  std::vector<std::shared_ptr<Overlay>> loaded;
  loaded.reserve(specs.size());
  for (OverlaySpec& spec : specs) loaded.push_back(next_of(source, std::move(spec)));
  std::vector<std::shared_ptr<Overlay>> all = loaded;
  for (const auto& each : all_) {
    if (each->spec().source != source) all.push_back(each);
  }
  all_ = std::move(all);
  for (std::size_t i = 0; i < all_.size(); ++i) all_[i]->order_ = i;
  return loaded;
}

std::shared_ptr<Overlay> Overlays::put(const std::string& source, OverlaySpec spec) {
  const LockGuard lock(mutex_);
  auto next = next_of(source, std::move(spec));
  const auto found = std::find_if(all_.begin(), all_.end(), [&](const auto& each) {
    return each->spec().source == source && each->spec().rule == next->spec().rule;
  });
  next->order_ = static_cast<std::size_t>(found - all_.begin());
  if (found != all_.end()) {
    *found = next;
  } else {
    all_.push_back(next);
  }
  return next;
}

/// One that takes the place of the rule of the same name and source, and goes on as that.
std::shared_ptr<Overlay> Overlays::next_of(const std::string& source, OverlaySpec spec) const {
  spec.source = source;
  auto next = std::make_shared<Overlay>(std::move(spec), word_);
  for (const auto& old : all_) {
    if (old->spec().source != source || old->spec().rule != next->spec().rule) continue;
    next->go_on_as(*old);
    if (!old->is_engaged()) continue;
    next->given_back_ = old->given_back_;
    for (const Assigned& one : old->spec().assigns) next->given_back_.push_back(one.element);
    std::erase_if(next->given_back_, [&](const Element& one) { return next->find(one) != nullptr; });
  }
  return next;
}

void Overlays::set_active(const std::shared_ptr<Overlay>& overlay, bool is_active) {
  const LockGuard lock(mutex_);
  if (overlay->is_active() == is_active) return;
  overlay->set_active(is_active);
  for (const Assigned& one : overlay->spec().assigns) outdate(one.element);
}

void Overlays::set_engaged(const std::shared_ptr<Overlay>& overlay, bool is_engaged) {
  const LockGuard lock(mutex_);
  overlay->set_engaged(is_engaged);
}

std::vector<std::shared_ptr<Overlay>> Overlays::active() const {
  const LockGuard lock(mutex_);
  std::vector<std::shared_ptr<Overlay>> found;
  for (const auto& each : all_) {
    if (each->is_active()) found.push_back(each);
  }
  std::sort(found.begin(), found.end(),
            [](const auto& one, const auto& other) { return one->ranks_above(*other); });
  return found;
}

std::vector<std::shared_ptr<Overlay>> Overlays::at_work(const std::string& source) const {
  const LockGuard lock(mutex_);
  std::vector<std::shared_ptr<Overlay>> found;
  for (const auto& each : all_) {
    if (each->spec().source == source && (each->is_active() || each->is_engaged())) found.push_back(each);
  }
  return found;
}

std::shared_ptr<Overlay> Overlays::find(const std::string& rule) const {
  const LockGuard lock(mutex_);
  const auto found =
      std::find_if(all_.begin(), all_.end(), [&](const auto& each) { return each->spec().rule == rule; });
  return found != all_.end() ? *found : nullptr;
}

/// Those that are active, the highest first.
std::vector<const Overlay*> Overlays::ranked(const If& supposed) const {
  std::vector<const Overlay*> found;
  for (const auto& each : all_) {
    if (each.get() == supposed.rule ? supposed.is_active : each->is_active()) found.push_back(each.get());
  }
  std::sort(found.begin(), found.end(),
            [](const Overlay* one, const Overlay* other) { return one->ranks_above(*other); });
  return found;
}

/// Whether none of the elements of a rule that makes sense only whole is taken.
bool Overlays::contributes(const Overlay& whole, const std::vector<const Overlay*>& higher) const {
  for (const Assigned& one : whole.spec().assigns) {
    if (over_.contains(one.element) || is_rejected(one.element, one.step)) return false;
    for (const Overlay* other : higher) {
      if (other->find(one.element) != nullptr) return false;
    }
  }
  return true;
}

Wanted Overlays::wanted(const Element& element, const If& supposed) const {
  if (element.name == kState && stopped_.contains(element.target))
    return {.step = Assignment{.kind = "stop", .target = element.target}, .by = Wanted::By::stop};
  std::vector<const Overlay*> higher;
  const auto over = over_.find(element);
  bool has_over = over != over_.end() && !is_rejected(element, over->second.step);
  bool is_covered = false;
  const auto person = [&] { return Wanted{.step = over->second.step, .by = Wanted::By::over}; };
  for (const Overlay* rule : ranked(supposed)) {
    const Assignment* const step = rule->find(element);
    is_covered = is_covered || step != nullptr;
    if (rule->spec().whole && !contributes(*rule, higher)) continue;
    higher.push_back(rule);
    if (step == nullptr) continue;
    if (has_over && (!rule->spec().safety || over->second.safety_rule == rule->spec().rule)) return person();
    if (!is_rejected(element, *step))
      return {.step = *step, .by = Wanted::By::rule, .rule = rule->spec().rule};
  }
  if (has_over && is_covered) return person();
  const std::optional<Assignment> base = base_of(element, supposed);
  if (!base || !is_rejected(element, *base)) return {.step = base, .by = Wanted::By::base};
  if (const auto found = bases_.find(element); found != bases_.end()) {
    if (found->second.value && !is_rejected(element, *found->second.value))
      return {.step = found->second.value, .by = Wanted::By::base};
    for (const Assignment& before : found->second.history) {
      if (!is_rejected(element, before)) return {.step = before, .by = Wanted::By::base};
    }
  }
  return {.step = Assignment{.kind = "stop", .target = element.target}, .by = Wanted::By::none};
}

/// What it is without rules and persons: what rules that have ended leave comes first.
std::optional<Assignment> Overlays::base_of(const Element& element, const If& supposed) const {
  for (const auto& each : all_) {
    const bool has_ended =
        each.get() == supposed.rule ? !supposed.is_active : each->activity() == Activity::ended;
    if (!has_ended) continue;
    for (const Assigned& one : each->spec().leaves) {
      if (one.element == element && may_leave(*each, one)) return one.step;
    }
  }
  const auto found = bases_.find(element);
  return found != bases_.end() ? found->second.value : std::nullopt;
}

/// Whether the rule's end gives the element another base: not where a person gave it one, nor where its own value, which would
/// stay, never was there.
bool Overlays::may_leave(const Overlay& rule, const Assigned& left) const {
  if (rule.leaves_own(left) && !rule.was_in_force(left.element)) return false;
  const auto found = bases_.find(left.element);
  return rule.spec().leaves_over_persons || found == bases_.end() || !is_person(found->second.author);
}

/// Who brings the element to what is wanted: the rule that holds it, else the highest that assigns it.
const Overlay* Overlays::driver(const Element& element, const If& supposed) const {
  const Wanted found = wanted(element, supposed);
  for (const Overlay* rule : ranked(supposed)) {
    if (rule->find(element) == nullptr) continue;
    if (found.by != Wanted::By::rule || found.rule == rule->spec().rule) return rule;
  }
  return nullptr;
}

std::vector<Assignment> Overlays::steps_if(const Overlay& rule, bool is_active,
                                           const ArchitectureDescription* description) const {
  const LockGuard lock(mutex_);
  const std::vector<Assigned> all = steps(rule, is_active);
  return steps_of(description != nullptr ? differences(all, *description) : all);
}

std::optional<bool> Overlays::is_so(const Overlay& rule, bool is_active,
                                    const ArchitectureDescription& description) const {
  const auto sets_one = [](const Assigned& one) { return !one.element.target.empty(); };
  const auto& assigns = rule.spec().assigns;
  if (std::none_of(assigns.begin(), assigns.end(), sets_one)) return std::nullopt;
  const LockGuard lock(mutex_);
  const std::vector<Assigned> left = differences(steps(rule, is_active), description);
  return std::none_of(left.begin(), left.end(), sets_one);
}

/// What the rule brings about once it is active, or no longer is.
std::vector<Assigned> Overlays::steps(const Overlay& rule, bool is_active) const {
  const If once{.rule = &rule, .is_active = is_active};
  const If at_work{.rule = &rule, .is_active = true};
  std::vector<Assigned> found;
  for (const Assigned& one : rule.spec().assigns) {
    if (one.element.target.empty()) {
      if (is_active) found.push_back(one);
    } else if (driver(one.element, at_work) == &rule) {
      const Wanted next = wanted(one.element, once);
      if (next.by == Wanted::By::rule && next.rule == rule.spec().rule) {
        found.push_back(one);
      } else {
        enter_wanted(found, one.element, one.step.kind, once);
      }
    }
  }
  for (const Element& element : rule.given_back_) {
    if (wanted(element, once).by != Wanted::By::rule) enter_wanted(found, element, {}, once);
  }
  if (!is_active) {
    for (const Assigned& one : rule.spec().leaves) {
      if (one.element.target.empty()) {
        found.push_back(one);
      } else if (rule.find(one.element) == nullptr && wanted(one.element, once).by == Wanted::By::base) {
        enter_wanted(found, one.element, one.step.kind, once);
      }
    }
  }
  return is_active ? found : in_order(found);
}

/// The step to what is wanted of an element, once.
void Overlays::enter_wanted(std::vector<Assigned>& found, const Element& element, const std::string& kind,
                            const If& once) const {
  for (const Assigned& one : found) {
    if (one.element == element) return;
  }
  std::optional<Assignment> step = wanted(element, once).step;
  if (!step) return;
  if (element.name.empty() && step->kind.starts_with("add_") && !step->value) return;  // of what parts?
  if (element.name.empty() && step->kind.starts_with("remove_") && kind.ends_with("_resource"))
    step->kind = "remove_resource";
  found.push_back({element, *std::move(step)});
}

std::uint64_t Overlays::changes() const {
  const LockGuard lock(mutex_);
  return changes_;
}

void Overlays::settle_ended() {
  const LockGuard lock(mutex_);
  for (const auto& each : all_) {
    Activity ended = Activity::ended;  // who decides may have it active again
    if (!each->activity_.compare_exchange_strong(ended, Activity::inactive, std::memory_order_acq_rel))
      continue;
    for (const Assigned& one : each->spec().leaves) {
      if (!one.element.target.empty() && may_leave(*each, one))
        change_base(one.element, one.step, std::string(kByRule) + each->spec().rule);
    }
  }
  for (auto over = over_.begin(); over != over_.end();)
    over = is_covered(over->first) ? std::next(over) : over_.erase(over);
}

/// Whether an active rule sets it.
bool Overlays::is_covered(const Element& element) const {
  return std::any_of(all_.begin(), all_.end(),
                     [&](const auto& each) { return each->is_active() && each->find(element) != nullptr; });
}

// ---- over a restart

void Overlays::bump() noexcept { bump_word(*word_); }

KeptState Overlays::kept(const ArchitectureDescription& file) const {
  const LockGuard lock(mutex_);
  KeptState state;
  for (const auto& each : all_) {
    if (each->spec().latch && each->is_active()) state.active.push_back(each->spec());
  }
  state.rejected = rejected_;
  for (const auto& [element, base] : bases_) {
    if (!base.value || !is_person(base.author) || !is_kept_base(element)) continue;
    if (find_named(file.components, element.target) == nullptr) continue;
    std::optional<Assignment> of_file = present(file, element);
    if (of_file && is_same_effect(*of_file, *base.value)) continue;
    state.bases.push_back(
        {.assigned = {element, *base.value}, .author = base.author, .of_file = std::move(of_file)});
  }
  return state;
}

std::vector<KeptBase> Overlays::restore(const KeptState& state, const std::set<std::string>& rules,
                                        const ArchitectureDescription& file) {
  const LockGuard lock(mutex_);
  for (OverlaySpec spec : state.active) {
    for (const auto* steps : {&spec.assigns, &spec.leaves}) {
      for (const Assigned& one : *steps) base_on(file, one.element);
    }
    if (spec.source != kHeldStopped) spec.source = rules.contains(spec.rule) ? "" : std::string(kKept);
    auto overlay = std::make_shared<Overlay>(std::move(spec), word_);
    overlay->set_engaged(true);
    overlay->set_active(true);
    overlay->order_ = all_.size();
    all_.push_back(std::move(overlay));
  }
  rejected_ = state.rejected;
  for (const Assigned& one : rejected_) base_on(file, one.element);
  std::vector<KeptBase> left_out;
  for (const KeptBase& base : state.bases) {
    const std::optional<Assignment> now = present(file, base.assigned.element);
    const bool is_same = now.has_value() == base.of_file.has_value() &&
                         (!now.has_value() || is_same_effect(*now, *base.of_file));
    if (is_same) {
      change_base(base.assigned.element, base.assigned.step, base.author);
    } else {
      left_out.push_back(base);
    }
  }
  return left_out;
}

/// The base of an element that has none yet: as the file says; all start at the activation.
void Overlays::base_on(const ArchitectureDescription& file, const Element& element) {
  if (element.target.empty() || bases_.contains(element)) return;
  if (element.name == kState)
    return change_base(element, Assignment{.kind = "start", .target = element.target}, {});
  change_base(element, present(file, element), {});
}

std::vector<std::pair<std::string, Assignment>> Overlays::restoring_steps(
    const ArchitectureDescription& description) const {
  const LockGuard lock(mutex_);
  std::vector<Element> elements;
  for (const Overlay* rule : ranked({})) {
    for (const Assigned& one : rule->spec().assigns) elements.push_back(one.element);
  }
  for (const auto& [element, base] : bases_) elements.push_back(element);
  std::vector<Assigned> found;
  std::map<Element, std::string> authors;
  for (const Element& element : elements) {
    if (element.target.empty() || element.name == kState || authors.contains(element)) continue;
    const Wanted now = wanted(element, {});
    if (!now.step || (now.by != Wanted::By::rule && now.by != Wanted::By::base)) continue;
    authors[element] =
        now.by == Wanted::By::rule ? std::string(kByRule) + now.rule : bases_.find(element)->second.author;
    found.push_back({element, *now.step});
  }
  std::vector<std::pair<std::string, Assignment>> steps;
  for (const Assigned& one : differences(in_order(found), description))
    steps.emplace_back(authors[one.element], one.step);
  return steps;
}

bool Overlays::move(const std::string& rule, const std::string& from, const std::string& to) {
  const LockGuard lock(mutex_);
  for (auto& each : all_) {
    if (each->spec().source != from || each->spec().rule != rule) continue;
    OverlaySpec spec = each->spec();
    spec.source = to;
    auto moved = std::make_shared<Overlay>(std::move(spec), word_);
    moved->go_on_as(*each);
    moved->given_back_ = each->given_back_;
    moved->order_ = each->order_;
    each = std::move(moved);
    bump();
    return true;
  }
  return false;
}

// ---- following the architecture

Overlays::Look Overlays::look() const {
  const LockGuard lock(mutex_);
  Look seen;
  for (const auto& each : all_) seen[each.get()] = each->engaged();
  return seen;
}

/// Whether no rule had its hand on it since the look.
bool Overlays::is_free(const Element& element, const Look& before) const {
  return std::all_of(all_.begin(), all_.end(), [&](const auto& each) {
    return was_free(*each, before) || (each->find(element) == nullptr && !each->has_given_back(element));
  });
}

bool Overlays::was_free(const Overlay& each, const Look& before) {
  const auto seen = before.find(&each);
  return seen != before.end() && !each.is_engaged() && seen->second == each.engaged();
}

void Overlays::follow(const Look& before, const ArchitectureDescription& description,
                      const std::vector<Authored>& authors, const std::vector<Assigned>& faulted) {
  const LockGuard lock(mutex_);
  for (const Assigned& core : faulted) {
    if (std::find(faulted_.begin(), faulted_.end(), core) == faulted_.end()) note_rejected(core);
  }
  faulted_ = faulted;
  const auto author_of = [&](const Element& element) {
    const auto found = std::find_if(authors.begin(), authors.end(), [&](const Authored& one) {
      return one.target == element.target && one.element == element.name;
    });
    return found != authors.end() ? found->author : std::string();
  };
  for (const auto& each : all_) {
    for (const Assigned& one : each->spec().assigns) {
      if (one.element.target.empty() || !each->is_active()) continue;
      const Wanted now = wanted(one.element, {});
      if (now.by != Wanted::By::rule || now.rule != each->spec().rule) continue;
      const std::optional<Assignment> there = present(description, one.element);
      if (there && is_same_effect(*there, one.step)) note_in_force(*each, one);
    }
    if (!was_free(*each, before)) continue;
    each->given_back_.clear();
    for (const auto* steps : {&each->spec().assigns, &each->spec().leaves}) {
      for (const Assigned& one : *steps) {
        if (!one.element.target.empty() && is_free(one.element, before))
          change_base(one.element, present(description, one.element), author_of(one.element));
      }
    }
  }
}

void Overlays::note(const Assigned& assigned, const std::string& author) {
  const auto& [element, step] = assigned;
  const LockGuard lock(mutex_);
  if (author.starts_with(kByRule)) {
    for (const auto& each : all_) {
      if (author.substr(kByRule.size()) == each->spec().rule) note_in_force(*each, assigned);
    }
    return;
  }
  if (!is_made_again(step)) return;
  if (step.kind == "stop") {
    stopped_.insert(element.target);
    return;
  }
  if (step.kind == "start") stopped_.erase(element.target);
  pardon(assigned);
  if (const auto over = over_.find(element); over != over_.end() && is_same_effect(over->second.step, step))
    return;
  const Wanted now = wanted(element, {});
  if (now.by == Wanted::By::rule && now.step && is_same_effect(*now.step, step)) return;  // it is its own
  change_base(element, step, author);
}

/// What the end of the rule leaves may be another by that.
void Overlays::note_in_force(Overlay& rule, const Assigned& assigned) {
  if (!rule.is_active() || !rule.leaves_own(assigned) || rule.was_in_force(assigned.element)) return;
  const std::uint32_t activations = rule.activations_.load(std::memory_order_acquire);
  if (std::exchange(rule.in_force_since_, activations) != activations) rule.in_force_.clear();
  rule.in_force_.push_back(assigned.element);
  if (!rule.spec().leaves.empty()) outdate(assigned.element);
}

/// What was found out of who assigns it, is of yesterday.
void Overlays::outdate(const Element& element) {
  ++changes_;
  bump();
  for (const auto& each : all_) {
    if (each->find(element) == nullptr && !each->has_given_back(element)) continue;
    each->outdate(true);
    each->outdate(false);
  }
}

void Overlays::change_base(const Element& element, std::optional<Assignment> step,
                           const std::string& author) {
  Base& base = bases_[element];
  const bool is_same =
      base.value.has_value() == step.has_value() && (!step.has_value() || is_same_effect(*base.value, *step));
  if (!is_same || !author.starts_with(kByRule)) base.author = author;  // a rule only puts it back
  if (is_same) return;
  if (base.value) base.history.push_front(*std::move(base.value));
  if (base.history.size() > kMostHistory) base.history.pop_back();
  base.value = std::move(step);
  outdate(element);
}

// ---- persons

Wanted Overlays::wanted(const Element& element) const {
  const LockGuard lock(mutex_);
  return wanted(element, {});
}

std::string Overlays::holder_against(const Assigned& assigned) const {
  const LockGuard lock(mutex_);
  const Wanted now = wanted(assigned.element, {});
  const bool is_kept = now.by == Wanted::By::rule && now.step && !is_same_effect(*now.step, assigned.step);
  return is_kept ? now.rule : "";
}

void Overlays::put_over(const Assigned& assigned, const std::string& safety_rule) {
  const LockGuard lock(mutex_);
  pardon(assigned);
  over_[assigned.element] = {.step = assigned.step, .safety_rule = safety_rule};
  outdate(assigned.element);
}

std::vector<Element> Overlays::take_off(const std::string& rule) {
  const LockGuard lock(mutex_);
  std::vector<Element> found;
  for (const auto& [element, over] : over_) {
    const bool is_about = std::any_of(all_.begin(), all_.end(), [&, name = element](const auto& each) {
      return each->spec().rule == rule && each->find(name) != nullptr;
    });
    if (rule.empty() || is_about) found.push_back(element);
  }
  for (const Element& element : found) {
    over_.erase(element);
    outdate(element);
  }
  return found;
}

void Overlays::take_off(const Element& element) {
  const LockGuard lock(mutex_);
  over_.erase(element);
  outdate(element);
}

void Overlays::lift_stop(const std::string& component) {
  const LockGuard lock(mutex_);
  stopped_.erase(component);
}

void Overlays::set_base(const Assigned& assigned, const std::string& author) {
  const LockGuard lock(mutex_);
  change_base(assigned.element, assigned.step, author);
}

void Overlays::start_all() {
  const LockGuard lock(mutex_);
  stopped_.clear();
}

bool Overlays::is_kept_stopped(const std::string& component,
                               const ArchitectureDescription& description) const {
  const LockGuard lock(mutex_);
  for (const Assigned& one : rejected_) {
    if (one.element.target != component) continue;
    const std::optional<Assignment> now = present(description, one.element);
    if (now && is_same_effect(*now, one.step)) return true;
  }
  const Wanted found = wanted({.target = component, .name = std::string(kState)}, {});
  return found.by == Wanted::By::rule && found.step && found.step->kind == "stop";
}

// ---- what was rejected

void Overlays::reject(const Assigned& assigned) {
  const LockGuard lock(mutex_);
  note_rejected(assigned);
}

void Overlays::note_rejected(const Assigned& assigned) {
  if (!is_rejected(assigned.element, assigned.step)) rejected_.push_back(assigned);
  outdate(assigned.element);
}

/// A person asks for it: it may be put in again.
void Overlays::pardon(const Assigned& assigned) {
  const std::size_t pardoned = std::erase_if(rejected_, [&](const Assigned& one) {
    return one.element == assigned.element && is_same_effect(one.step, assigned.step);
  });
  if (pardoned != 0) bump();
}

void Overlays::forgive(const Element& element) {
  const LockGuard lock(mutex_);
  std::erase_if(rejected_, [&](const Assigned& one) { return one.element == element; });
  outdate(element);
}

std::vector<Assigned> Overlays::rejected() const {
  const LockGuard lock(mutex_);
  return rejected_;
}

bool Overlays::is_rejected(const Element& element, const Assignment& step) const {
  return std::any_of(rejected_.begin(), rejected_.end(), [&](const Assigned& one) {
    return one.element == element && is_same_effect(one.step, step);
  });
}

std::vector<HeldElement> Overlays::table() const {
  const LockGuard lock(mutex_);
  std::map<Element, HeldElement> found;
  const auto enter = [&](const Element& element) -> HeldElement& {
    HeldElement& held = found[element];
    held.element = element;
    return held;
  };
  for (const Overlay* rule : ranked({})) {
    std::set<Element> entered;
    for (const Assigned& one : rule->spec().assigns) {
      if (!one.element.target.empty() && entered.insert(one.element).second)
        enter(one.element).rules.push_back(rule->spec().rule);
    }
  }
  for (const std::string& component : stopped_) enter({.target = component, .name = std::string(kState)});
  std::vector<HeldElement> all;
  for (auto& [element, held] : found) {
    held.base = base_of(element, {});
    held.wanted = wanted(element, {});
    all.push_back(std::move(held));
  }
  return all;
}

}  // namespace mauve

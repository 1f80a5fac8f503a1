// SPDX-License-Identifier: LGPL-3.0-or-later
#include "change/steps/step_kind.hpp"

#include <array>

#include "parts/lookup.hpp"

namespace mauve {

namespace {

#define MAUVE_LIST_STEP_KIND(name) &steps::name,
constexpr std::array kStepKinds{MAUVE_STEP_KINDS(MAUVE_LIST_STEP_KIND)};
#undef MAUVE_LIST_STEP_KIND

const StepKind& kind_of(std::string_view name) {
  std::vector<std::string> names;
  for (const StepKind* kind : kStepKinds) {
    if (kind->name == name) return *kind;
    names.emplace_back(kind->name);
  }
  throw Error(ErrorCode::invalid_argument, "there is no such kind of step",
              {.element = "step " + std::string(name), .expected = join(names)});
}

}  // namespace

TransactionStep::TransactionStep(const StepKind& its_kind, std::string its_target, std::string its_name,
                                 StepValue its_value)
    : target(std::move(its_target)),
      name(std::move(its_name)),
      value(std::move(its_value)),
      kind_(its_kind),
      text_(its_kind.name) {
  if (const std::string words = its_kind.words(*this); !words.empty()) text_ += " " + words;
}

std::string_view TransactionStep::kind() const noexcept { return kind_.name; }

const std::string& TransactionStep::component() const noexcept {
  static const std::string none;
  return kind_.target == StepTarget::component ? target : none;
}

bool TransactionStep::is_for_all() const noexcept { return kind_.target == StepTarget::all; }

bool TransactionStep::is_structural() const noexcept { return kind_.is_structural; }

std::string TransactionStep::element() const {
  const std::string kind(kind_.element);
  return kind == "property" || kind == "port" ? kind + " " + name : kind;
}

bool TransactionStep::removes() const noexcept { return kind_.removes; }

void TransactionStep::draft(Draft& draft) { kind_.draft(draft, *this); }

Transaction& Transaction::add(const StepKind& kind, std::string target, std::string name, StepValue value) {
  steps_.push_back(
      std::make_unique<TransactionStep>(kind, std::move(target), std::move(name), std::move(value)));
  return *this;
}

Transaction& Transaction::add(std::string_view kind, std::string target, std::string name, StepValue value) {
  return add(kind_of(kind), std::move(target), std::move(name), std::move(value));
}

Transaction& Transaction::by(std::string author) {
  author_ = std::move(author);
  return *this;
}

void throw_other_value(const TransactionStep& step) {
  throw Error(ErrorCode::invalid_argument, "the step has another value than its kind takes",
              {.element = step.text(), .remedy = "give it by the call of Transaction that bears its name"});
}

std::string element_words(const TransactionStep& step) {
  const auto* value = std::get_if<PropertyValue>(&step.value);
  return step.target + "." + step.name + (value != nullptr ? " " + to_string(*value) : "");
}

DraftComponent& replacing(Draft& draft, const std::string& component) {
  DraftComponent& changed = draft.change(component);
  if (changed.is_added || changed.component->is_configured()) return changed;
  throw Error(ErrorCode::not_configured, "the component is not configured",
              {.component = component, .remedy = "configure it first, or build it with the other part"});
}

void require_not_promoted(const DraftComponent& component) {
  if (component.promoted == nullptr) return;
  throw Error(ErrorCode::invalid_argument,
              "a step before has promoted the candidate of the component's shadow",
              {.component = component.name(),
               .element = "core",
               .remedy = "leave one of the two steps out, or make two transactions"});
}

}  // namespace mauve

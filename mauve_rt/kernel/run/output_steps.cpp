// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/output_steps.hpp"

#include <algorithm>
#include <cmath>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/run/blend.hpp"

#include "base/number_text.hpp"
#include "parts/lookup.hpp"

namespace mauve {

namespace {

/// Each of them is looked at in each release.
constexpr std::size_t kMostOutputs = 100;

std::string name_of(const GreatestStep& output) {
  return output.port + (output.field.empty() ? "" : "." + output.field);
}

}  // namespace

void check_options(const BumplessOptions& options, const std::string& component) {
  const auto refuse = [&](const char* what, const std::string& element, const std::string& expected,
                          const std::string& found, const char* remedy) {
    throw Error(
        ErrorCode::invalid_argument, what,
        {.component = component, .element = element, .expected = expected, .found = found, .remedy = remedy});
  };
  if (options.within_ns <= 0 || options.within_ns > kLongest)
    refuse("a change cannot wait that long for near outputs", "within_s",
           "1 to " + std::to_string(kLongest) + " ns", std::to_string(options.within_ns),
           "give a time in which the component has some releases");
  if (options.budget_ns < 0)
    refuse("the candidate's budget is no length of time", "budget_us", "0 or more",
           std::to_string(options.budget_ns), "leave it out: the budget is the component's period then");
  if (options.blend_ns < 0 || options.blend_ns > Blend::kLongest)
    refuse("the outputs cannot go over for that long", "blend_s",
           "0 to " + std::to_string(Blend::kLongest / s_to_ns(1)) + " s",
           number_text(static_cast<double>(options.blend_ns) / 1e9) + " s",
           "give a shorter time: both cores execute for it");
  if (options.outputs.empty() || options.outputs.size() > kMostOutputs)
    refuse("a bumpless change needs the outputs that it bounds", "outputs",
           "1 to " + std::to_string(kMostOutputs) + " outputs", std::to_string(options.outputs.size()),
           "name each output with its greatest step");
  for (const GreatestStep& output : options.outputs) {
    if (std::isfinite(output.step) && output.step >= 0.0) continue;
    refuse("the greatest step of an output is no length", "output " + name_of(output), "a number >= 0",
           number_text(output.step), "give it in the unit of the output");
  }
}

OutputSteps::OutputSteps(const Shell& shell, const std::string& component,
                         const std::vector<GreatestStep>& outputs)
    : all_(outputs.size()) {
  auto next = all_.begin();
  for (const GreatestStep& output : outputs) {
    const PortBase& port = find_port(shell, output.port, component);
    const auto refuse = [&](const char* what, const std::string& expected, const std::string& found,
                            const char* remedy) {
      throw Error(ErrorCode::invalid_argument, what,
                  {.component = component,
                   .element = "output " + name_of(output),
                   .expected = expected,
                   .found = found,
                   .remedy = remedy});
    };
    if (port.kind() != PortKind::write)
      refuse("only an output has a greatest step", "a write port", std::string(to_string(port.kind())),
             "name one of the component's write ports");
    if (port.output().on_commit == OutputPolicy::set_zero)
      refuse("the port itself makes a step at each change", "on_commit: hold", "on_commit: set_zero",
             "declare on_commit: hold for the port, or leave the output out");
    const std::optional<NumberPlace> place = port.find_number(output.field);
    if (!place)
      refuse("the output has no number there that can be read in real time",
             "a field of " + port.type() + " that is a number, not in a text or a list without a bound",
             output.field.empty() ? "no field" : output.field, "name the field of a number");
    const auto& ports = shell.ports();
    const auto its =
        std::find_if(ports.begin(), ports.end(), [&](const auto& each) { return each.get() == &port; });
    next->output = name_of(output);
    next->port = static_cast<std::size_t>(its - ports.begin());
    next->place = place.value_or(NumberPlace{});
    next->greatest = output.step;
    ++next;
  }
}

void OutputSteps::note(std::size_t port, const void* live, const void* candidate) {
  for (One& each : all_) {
    if (each.port != port) continue;
    if (live != nullptr) each.live = each.place.of(live);
    if (candidate != nullptr) each.candidate = each.place.of(candidate);
  }
}

bool OutputSteps::compare(time_ns_t instant_ns) {
  bool are_near = true;
  for (One& each : all_) {
    each.compared[compared_ % kCurve] = {
        .instant_ns = instant_ns, .live = each.live, .candidate = each.candidate};
    const double difference =
        std::abs(each.candidate - each.live);  // NaN where one of them is, or is unknown
    are_near &= difference <= each.greatest;
    if (std::isnan(difference) || difference >= each.least) continue;  // NaN >= nothing
    each.least = difference;
    each.least_instant_ns = instant_ns;
  }
  ++compared_;
  return are_near;
}

bool OutputSteps::are_known() const noexcept {
  return std::none_of(all_.begin(), all_.end(), [](const One& each) { return each.is_awaited; });
}

std::vector<OutputStep> OutputSteps::shown() const {
  std::vector<OutputStep> shown;
  shown.reserve(all_.size());
  for (const One& each : all_) {
    shown.push_back({.output = each.output,
                     .greatest = each.greatest,
                     .difference = each.candidate - each.live,
                     .least = each.least,
                     .least_instant_ns = each.least_instant_ns,
                     .step = each.step.load(std::memory_order_relaxed)});
  }
  return shown;
}

std::vector<OutputCurve> OutputSteps::curves() const {
  std::vector<OutputCurve> curves;
  for (const One& each : all_) {
    OutputCurve& curve = curves.emplace_back();
    curve.output = each.output;
    curve.instant_ns = instant_ns_.load(std::memory_order_relaxed);
    for (std::size_t number = compared_ - std::min(compared_, kCurve); number < compared_; ++number) {
      const Compared& release = each.compared[number % kCurve];
      curve.instants_ns.push_back(release.instant_ns);
      curve.live.push_back(release.live);
      curve.candidate.push_back(release.candidate);
    }
    const std::size_t count = each.news_count.load(std::memory_order_acquire);
    for (std::size_t number = 0; number < count; ++number) {
      curve.new_instants_ns.push_back(each.news[number].instant_ns);
      curve.new_core.push_back(each.news[number].number);
    }
  }
  return curves;
}

}  // namespace mauve
